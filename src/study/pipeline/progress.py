"""Estimate of a run's remaining time, and a list of the jobs that a dry run would start."""

import logging
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import accumulate

from snakemake_interface_logger_plugins.common import LogEvent

# An estimate needs this number of finished jobs, and this share of the total expected time in them.
ENOUGH_JOBS, ENOUGH = 2, 0.05
# Smallest remaining time of an unfinished job, as a fraction of its expected duration.
REST = 0.1
# A reason of Snakemake for running a job; left out if a job has another reason as well. `REASONS`
# maps the beginnings of all reasons to our shorter texts.
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
    share : fraction of this machine's cores that the job uses; 1 on a cluster
    after : expected seconds of the longest chain of jobs that can start only after this job
    """

    seconds: float
    share: float
    after: float


@dataclass
class Estimate:
    """Estimate of the remaining seconds of a run.

    It is the remaining core time divided by the mean number of cores in use until now, but at least
    the time of the longest chain of jobs. Expected times are multiplied by the slowdown of this
    machine: the median ratio of measured to expected time of finished jobs, weighted by expected
    time, on which a few jobs that compile kernels first have little effect.

    jobs : number of a job -> its expected time
    begun, ended : number of a job -> time in s at which it started or ended
    """

    jobs: Mapping[int, Expected] = field(default_factory=dict)
    begun: dict[int, float] = field(default_factory=dict)
    ended: dict[int, float] = field(default_factory=dict)

    def left(self, now: float) -> float | None:
        """Return the remaining seconds at time ``now`` (in s); None until enough jobs are done."""
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
    """Return ``seconds`` as a rounded duration in words, such as "about 2.5 min"."""
    minutes = seconds / 60
    if minutes < 1:
        return "less than a minute"
    if minutes < 90:
        return f"about {round(minutes) if minutes > 5 else round(2 * minutes) / 2:g} min"
    return f"about {minutes / 60:.1f} h"


class Preview(logging.Handler):
    """Log handler that reads Snakemake's messages in a dry run and counts the jobs.

    seconds : function that maps the path of a job's log to its expected processor seconds
    faults : path of a result -> why its job runs, if Snakemake does not know
    cores : number of cores of the run; a job that measures times needs all of them
    """

    def __init__(
        self, seconds: Callable[[str], float], cores: int, faults: Mapping[str, str]
    ) -> None:
        super().__init__(logging.INFO)
        self._faults = faults
        self._of_job, self._cores = seconds, cores
        self._jobs: Counter[str] = Counter()
        self._reasons: defaultdict[str, set[str]] = defaultdict(set)
        self._processor = self._wall = 0.0
        self._ended = False

    def emit(self, record: logging.LogRecord) -> None:
        """Count the job that ``record`` announces; collect its reasons to run and expected time."""
        self._ended = self._ended or END in record.getMessage()
        if getattr(record, "event", None) != LogEvent.JOB_INFO:
            return
        self._jobs[record.rule_name] += 1
        known = {self._faults[path] for path in record.output if path in self._faults}
        self._reasons[record.rule_name] |= known or shortened(record.reason)
        if record.log:  # rules without a log only collect targets and take no time
            seconds = self._of_job(str(record.log[0]))
            self._processor += seconds
            self._wall += seconds * min(record.threads, self._cores) / self._cores

    def text(self) -> str:
        """Text with one line per rule, then the totals; empty if the dry run did not finish."""
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
    """Short texts (values of `REASONS`) for Snakemake's text ``reason`` on why a job has to run."""
    found = [text for text in REASONS if reason.startswith(text) or f"; {text}" in reason]
    own = [text for text in found if text != FOLLOWS] or found
    return {REASONS[text] for text in own}
