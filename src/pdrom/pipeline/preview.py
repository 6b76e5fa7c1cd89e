"""What a dry run says last: the jobs of each rule with the reasons, and how long all take."""

import atexit
import logging
import sys
from collections import Counter, defaultdict
from collections.abc import Callable

from snakemake_interface_logger_plugins.common import LogEvent

from pdrom.pipeline.progress import rounded

# Snakemake's reasons, as they begin, and in fewer words. The last one follows from other jobs and
# is left out beside another one.
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
    FOLLOWS: "input is made anew",
}
END = "This was a dry-run"


class Preview(logging.Handler):
    """Listens to Snakemake's log for the jobs of a plan.

    Parameters
    ----------
    seconds : expected processor time of a job, given its log
    cores : how many there are; a job that is alone claims all of them
    """

    def __init__(self, seconds: Callable[[str], float], cores: int) -> None:
        super().__init__(logging.INFO)
        self._of_job, self._cores = seconds, cores
        self._jobs: Counter[str] = Counter()
        self._reasons: defaultdict[str, set[str]] = defaultdict(set)
        self._processor = self._wall = 0.0
        self._ended = False

    def emit(self, record: logging.LogRecord) -> None:
        """Count a job."""
        self._ended = self._ended or END in record.getMessage()
        if getattr(record, "event", None) != LogEvent.JOB_INFO:
            return
        self._jobs[record.rule_name] += 1
        self._reasons[record.rule_name] |= shortened(record.reason)
        if record.log:  # what only names targets has none
            seconds = self._of_job(str(record.log[0]))
            self._processor += seconds
            self._wall += seconds * min(record.threads, self._cores) / self._cores

    def text(self) -> str:
        """A line for each rule, then jobs and minutes; nothing of a plan without an end."""
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
    """Reasons in a text of Snakemake's, which lists files and settings behind each."""
    found = [text for text in REASONS if reason.startswith(text) or f"; {text}" in reason]
    own = [text for text in found if text != FOLLOWS] or found
    return {REASONS[text] for text in own}


def preview(seconds: Callable[[str], float], cores: int) -> None:
    """Have this process say at its end what its dry run has planned, see `Preview`."""
    planned = Preview(seconds, cores)
    logging.getLogger("snakemake.logging").addHandler(planned)
    atexit.register(lambda: sys.stdout.write(planned.text()))
