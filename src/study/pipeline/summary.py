"""Last lines of a run: outcome and times; of a dry run, its jobs and their expected time."""

import atexit
import logging
import os
import shlex
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

import psutil
from snakemake_interface_logger_plugins.common import LogEvent

from pdrom.core.store import Condition, check_file, read_table
from study.artifact import paths
from study.pipeline.commandline import CommandLine
from study.pipeline.folders import Folders
from study.pipeline.progress import rounded

# Beginnings of Snakemake's reasons for a job, with shorter texts. The last reason only follows from
# other jobs and is left out if there is another reason.
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

# Load average per core, over five minutes, above which other programs must have been running.
BUSY = 1.7
LISTED = 8  # largest number of targets that the summary names


def processor_seconds() -> float:
    """Processor seconds used until now by this process and its child processes."""
    own = psutil.Process()
    total = 0.0
    for process in (own, *own.children(recursive=True)):
        try:
            times = process.cpu_times()
        except psutil.Error:  # the process has ended meanwhile
            continue
        total += times.user + times.system
        total += getattr(times, "children_user", 0.0) + getattr(times, "children_system", 0.0)
    return total


def summary(
    command: CommandLine,
    folders: Folders,
    figures: Sequence[str],
    tables: Sequence[str],
    apart: str = "",
) -> str:
    """Return the last lines of a successful run.

    Parameters
    ----------
    command, folders : command line of the run, and the folders of its results
    figures, tables : paths of all figures and tables of the complete study
    apart : words that mark verdicts of a study other than the full one; else empty
    """
    wall = time.time() - psutil.Process().create_time()
    lines = [f"configuration: {configuration(command)}"]
    if command.targets:
        more = len(command.targets) - LISTED
        others = [f"and {more} more"] if more > 0 else []
        lines.append(f"made: {', '.join([*command.targets[:LISTED], *others])}")
    else:
        if verdicts := verdicts_in(folders.results):
            words = f"as published / beyond; {apart}" if apart else "as published / beyond"
            said = [f"{claim} {' / '.join(pair)}" for claim, pair in verdicts.items()]
            lines.append(f"verdicts ({words}): {', '.join(said)}")
        lines.append(f"manuscript: {', '.join(folders.documents.values())}")
        lines.append(f"as pages: {paths.ARTICLE.at(folders.results, name='index.html')}")
        for kind, files in (("figures", figures), ("tables", tables)):
            found = sum(Path(file).is_file() for file in files)
            lines.append(f"{kind}: {found} in {folders.results}/{kind}")
        lines.append(f"report: {shlex.join(['./reproduce', '--report', 'report.html'])}")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    lines.append(
        f"time: {minutes(wall)} on {cores} cores, {minutes(processor_seconds())} of processor time"
    )
    if os.getloadavg()[1] > BUSY * (cores or 1):
        lines.append("times: worthless, other programs have used the processor, too")
    return "\n".join(f"pdrom: {line}" for line in lines) + "\n"


def minutes(seconds: float) -> str:
    """Duration of ``seconds`` as text in minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60} s" if whole >= 60 else f"{whole} s"


def configuration(command: CommandLine) -> str:
    """Names of the configuration files and settings of ``command``, in one line."""
    names = command.configfiles or ("config/default.yaml",)
    return ", ".join([*names, *command.settings])


def verdicts_in(results: str) -> dict[str, tuple[str, str]]:
    """Verdicts of each claim, (published, beyond); empty if the table cannot be read."""
    path = paths.TABLE.at(results, name="claims")
    # a damaged file is not renamed here; the job that reads it sets it aside
    if not Path(path).is_file() or check_file(path) is not Condition.INTACT:
        return {}
    table = read_table(path, ["claim", "verdict", "verdict_beyond"])
    return {row.claim: (row.verdict, row.verdict_beyond) for row in table.itertuples()}


class Preview(logging.Handler):
    """Log handler that counts the jobs of a dry run, from Snakemake's log.

    Parameters
    ----------
    seconds : function that returns the expected processor seconds of a job, given its log
    cores : number of cores, all of which a job that measures times claims
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


def preview(seconds: Callable[[str], float], cores: int) -> None:
    """Print the jobs of this dry run at the end of the process; arguments as in `Preview`."""
    planned = Preview(seconds, cores)
    logging.getLogger("snakemake.logging").addHandler(planned)
    atexit.register(lambda: sys.stdout.write(planned.text()))
