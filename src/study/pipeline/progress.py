"""List of the jobs that a dry run would start, with reasons, and their expected time."""

import logging
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping

from snakemake_interface_logger_plugins.common import LogEvent

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
        self, seconds: Callable[[str], float], cores: int, faults: Mapping[str, str]
    ) -> None:
        super().__init__(logging.INFO)
        self._seconds, self._cores, self._faults = seconds, cores, faults
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
            seconds = self._seconds(str(record.log[0]))
            self._processor += seconds
            self._wall += seconds * min(record.threads, self._cores) / self._cores

    def text(self) -> str:
        """Text with one line per rule, then the totals; empty if no job would run."""
        width = max(map(len, self._jobs), default=0)
        lines = [
            f"{count:>5} {rule:<{width}}  {', '.join(sorted(self._reasons[rule]))}\n"
            for rule, count in self._jobs.items()
        ]
        cores = f"{self._cores} core{'s' * (self._cores > 1)}"
        total = f"pdrom: {self._jobs.total()} jobs, {rounded(self._wall)} on {cores}"
        total += f", {rounded(self._processor)} of processor time\n"
        return "".join([*lines, total]) if lines else ""


def shortened(reason: str) -> set[str]:
    """Short texts (values of `REASONS`) for Snakemake's text ``reason`` on why a job has to run."""
    found = {words for text, words in REASONS.items() if text in reason}
    return found - {FOLLOWS} or found  # most jobs follow others: say so only without another reason
