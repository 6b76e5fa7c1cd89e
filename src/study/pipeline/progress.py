"""Estimate of a run's remaining time, and a list of the jobs that a dry run would start."""

import logging
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping

from snakemake_interface_logger_plugins.common import LogEvent

# An estimate needs this share of the work in finished jobs.
ENOUGH = 0.05
# Processor seconds that config/tiny.yaml spends on compiling; names of rules that compile nothing.
COMPILING = 30.0
IDLE = re.compile("figure_.*|.*_table|mesh|snapshots|pod|live_page|paper.*|article|all")
FOLLOWS = "input is made again"
# Beginnings of Snakemake's reasons for running a job -> our shorter texts.
REASONS = {
    "Forced execution": "forced",
    "Missing output files": "output is missing",
    "Incomplete output files": "output is incomplete",
    "Updated input files": "input is newer",
    "Set of input files has changed": "other input files",
    "Code has changed": "script has changed",
    "Params have changed": "settings or code have changed",
    "Input files updated by another job": FOLLOWS,
}


class Estimate:
    """Estimate of a run's remaining time: the rest of the work goes on as fast as until now.

    work : number of a job -> its expected processor seconds on all cores that the job uses
    begun : time in s at which the run has begun
    """

    def __init__(self, work: Mapping[int, float], begun: float) -> None:
        self._rest = dict(work)
        self._total, self._begun = sum(work.values()), begun

    def finish(self, job: int) -> None:
        """Count the work of the ``job`` of this number as done."""
        self._rest.pop(job, None)

    def words(self, now: float) -> str:
        """Share of the work that is done at time ``now`` (in s), and remaining time; or ""."""
        done = self._total - sum(self._rest.values())
        if done <= 0.0 or done < ENOUGH * self._total:
            return ""
        left = (now - self._begun) * (self._total / done - 1.0)
        return f"   {done / self._total:.0%} done, {rounded(left)} left"


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
    """

    def __init__(
        self, seconds: Callable[[str], float], cores: int, faults: Mapping[str, str], compiles: bool
    ) -> None:
        super().__init__(logging.INFO)
        self._faults, self._compiles = faults, compiles
        self._of_job, self._cores = seconds, cores
        self._jobs: Counter[str] = Counter()
        self._reasons: defaultdict[str, set[str]] = defaultdict(set)
        self._processor = self._wall = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Count the job that ``record`` announces; collect its reasons to run and expected time."""
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
        """Text with one line per rule, then the totals; empty if no job would run."""
        width = max(map(len, self._jobs), default=0)
        text = "".join(
            f"{count:>5} {rule:<{width}}  {', '.join(sorted(self._reasons[rule]))}\n"
            for rule, count in self._jobs.items()
        )
        own = COMPILING * (self._compiles and not all(map(IDLE.fullmatch, self._jobs)))
        cores = f"{self._cores} core{'s' * (self._cores > 1)}"
        total = f"pdrom: {self._jobs.total()} jobs, {rounded(self._wall + own)} on {cores}"
        more = f", of which up to {own:.0f} s compile kernels" if own else ""
        total += f", {rounded(self._processor + own)} of processor time{more}"
        return text and f"{text}{total}\n"


def shortened(reason: str) -> set[str]:
    """Short texts (values of `REASONS`) for Snakemake's text ``reason`` on why a job has to run."""
    found = {words for text, words in REASONS.items() if text in reason}
    return found - {FOLLOWS} or found  # most jobs follow others: say so only without another reason
