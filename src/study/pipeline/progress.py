"""Remaining time of a run, as an estimate, and the jobs of a dry run with their expected time."""

import logging
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import accumulate

from snakemake_interface_logger_plugins.common import LogEvent

# An estimate is shown after at least so many finished jobs and this share of the expected work.
ENOUGH_JOBS, ENOUGH = 2, 0.05
# Least expected remaining time of an unfinished job, as a fraction of its expected duration.
REST = 0.1
# Beginnings of Snakemake's reasons for running a job, with shorter texts. The reason `FOLLOWS` is
# a consequence of other jobs, and is left out if there is another reason.
FOLLOWS = "Input files updated by another job"
REASONS = {
    "Forced execution": "forced",
    "Missing output files": "output is missing",
    "Incomplete output files": "output is incomplete",
    "Updated input files": "input is newer",
    "Set of input files has changed": "other input files",
    "Code has changed": "script has changed",
    "Params have changed": "settings or code have changed",
    "Software environment definition has changed": "environment has changed",
    FOLLOWS: "input is made again",
}
END = "This was a dry-run"


@dataclass(frozen=True)
class Expected:
    """Expected time of a job.

    seconds : expected duration of the job
    share : claimed fraction of this machine's cores; 1 on a cluster
    after : expected seconds of the longest chain of jobs that wait for this job
    """

    seconds: float
    share: float
    after: float


@dataclass
class Estimate:
    """Estimate of the remaining seconds of a run.

    The slowdown of this machine is the median ratio of measured to expected time of finished jobs,
    weighted by expected time, so that the few jobs that compile kernels have little effect. The
    average number of parallel jobs follows from the core time that jobs have claimed until now.

    jobs, begun, ended : expected times, and times in s of start and end, by job number
    """

    jobs: Mapping[int, Expected] = field(default_factory=dict)
    begun: dict[int, float] = field(default_factory=dict)
    ended: dict[int, float] = field(default_factory=dict)

    def left(self, now: float) -> float | None:
        """Return the remaining seconds at the time ``now``, s; None while too few jobs are done."""
        begun = {number: start for number, start in self.begun.items() if number in self.jobs}
        ran = {number: self.ended.get(number, now) - start for number, start in begun.items()}
        done = [(ran[n], self.jobs[n].seconds) for n in ran if n in self.ended]
        finished = sum(seconds for _, seconds in done)
        total = sum(job.seconds for job in self.jobs.values())
        if len(done) < ENOUGH_JOBS or finished < ENOUGH * total:
            return None
        ordered = sorted((took / seconds, seconds) for took, seconds in done)
        below = accumulate(seconds for _, seconds in ordered)
        pairs = zip(ordered, below, strict=True)
        slower = next(quotient for (quotient, _), sum_ in pairs if sum_ >= finished / 2)
        work = chain = 0.0
        for number in self.jobs.keys() - self.ended.keys():
            job, expected = self.jobs[number], self.jobs[number].seconds * slower
            rest = max(expected - ran.get(number, 0.0), REST * expected)
            work += rest * job.share
            chain = max(chain, rest + job.after * slower)
        busy = sum(seconds * self.jobs[number].share for number, seconds in ran.items())
        return max(work * (now - min(begun.values())) / busy, chain)


def rounded(seconds: float) -> str:
    """Return a duration of ``seconds`` in words, rounded to the accuracy of the estimate."""
    minutes = seconds / 60
    if minutes < 1:
        return "less than a minute"
    if minutes < 90:
        return f"about {round(minutes) if minutes > 5 else round(2 * minutes) / 2:g} min"
    return f"about {minutes / 60:.1f} h"


class Preview(logging.Handler):
    """Log handler that counts the jobs of a dry run, by reading Snakemake's log.

    Parameters
    ----------
    seconds : function that returns the expected processor seconds of a job from its log's path
    cores : number of cores of the run; a job that measures times claims all of them
    """

    def __init__(self, seconds: Callable[[str], float], cores: int) -> None:
        super().__init__(logging.INFO)
        self._of_job, self._cores = seconds, cores
        self._jobs: Counter[str] = Counter()
        self._reasons: defaultdict[str, set[str]] = defaultdict(set)
        self._processor = self._wall = 0.0
        self._ended = False

    def emit(self, record: logging.LogRecord) -> None:
        """Add the job of a log ``record`` to the counts, reasons and times."""
        self._ended = self._ended or END in record.getMessage()
        if getattr(record, "event", None) != LogEvent.JOB_INFO:
            return
        self._jobs[record.rule_name] += 1
        self._reasons[record.rule_name] |= shortened(record.reason)
        if record.log:  # rules that only collect targets have no log and take no time
            seconds = self._of_job(str(record.log[0]))
            self._processor += seconds
            self._wall += seconds * min(record.threads, self._cores) / self._cores

    def text(self) -> str:
        """One line per rule, then totals of jobs and time; empty if the dry run did not finish."""
        if not self._ended:
            return ""
        width = max(map(len, self._jobs))
        lines = [
            f"{count:>5} {rule:<{width}}  {', '.join(sorted(self._reasons[rule]))}"
            for rule, count in self._jobs.items()
        ]
        wall = f"{rounded(self._wall)} on {self._cores} core{'s' * (self._cores > 1)}"
        lines.append(
            f"pdrom: {sum(self._jobs.values())} jobs, {wall}, "
            f"{rounded(self._processor)} of processor time"
        )
        return "\n".join(lines) + "\n"


def shortened(reason: str) -> set[str]:
    """Short texts of the reasons in Snakemake's message ``reason``, as a set."""
    found = [text for text in REASONS if reason.startswith(text) or f"; {text}" in reason]
    own = [text for text in found if text != FOLLOWS] or found
    return {REASONS[text] for text in own}
