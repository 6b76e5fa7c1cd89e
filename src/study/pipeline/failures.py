"""Report printed at the end of a failed run: every failed job with the cause of the failure."""

import logging
import re
import shutil
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from snakemake_interface_logger_plugins.common import LogEvent

from pdrom.core.errors import INTERRUPTED

ADVICE = "pdrom: what is finished is kept; the same command goes on from there"

_ERROR = re.compile(r"^[-0-9]+ [0-9:,]+ ERROR +pdrom: (?P<text>.*)$", re.MULTILINE)
# Python's message in a job's log after a fatal signal; it lists stack frames, the innermost first.
_CRASH = re.compile(
    r"^Fatal Python error: .*?^Current thread .*?\n(?P<frames>(?: +File .*\n?)+)", re.M | re.S
)
_FRAME = re.compile(r'^ +File "(?P<file>.*)", line (?P<line>\d+) in (?P<function>.*)$', re.M)
_IN_RULE = re.compile(r"^\w+ in rule (?P<rule>\w+)\b.*\n(?P<text>.*)", re.MULTILINE)
_ENDING = re.compile(r"died with <Signals\.(?P<signal>\w+)|exit status (?P<status>\d+)")
# Message of SLURM in the log of a batch of jobs, if SLURM cancelled the batch.
_BY_SLURM = re.compile(
    r"\*\*\* JOB \S+ ON \S+ (?P<status>CANCELLED) AT \S+(?: DUE TO (?P<why>[A-Z ]+?))? \*\*\*"
)
# Part of the error message of Snakemake's SLURM executor about a failed job.
_SLURM_STATUS = re.compile(r"SLURM status is: '(?P<status>\w+)'")
# Part of Snakemake's log message after the user has interrupted the run.
_INTERRUPTED = "Terminating processes on user request"
_CAUSES = {
    "SIGKILL": "killed (SIGKILL): out of memory?",
    "SIGTERM": "ended by SIGTERM",
    "SIGINT": "interrupted",
    "SIGXFSZ": "its file became larger than the system allows (SIGXFSZ)",
}
_STATUSES = {126: "its interpreter cannot be executed", 127: "its interpreter was not found"}
_FULL = ("No space left on device", "Errno 28")
_FULL_DISK = 1 << 18  # free bytes below which the disk counts as full


@dataclass(frozen=True)
class Failure:
    """A failed job: rule name, paths of log and first output, Snakemake's error message (said)."""

    rule: str
    log: str
    output: str
    said: str

    def written(self, begun: float) -> str:
        """Text of the job's log if it is newer than ``begun`` (Unix time in s), else empty."""
        path = Path(self.log)
        return _content(self.log) if path.is_file() and path.stat().st_mtime >= begun else ""

    def line(self, begun: float) -> str:
        """Line with job, cause and place of a crash, if a log newer than ``begun`` (s) has it."""
        folder = next((p for p in Path(self.output).parents if p.is_dir()), Path())
        errors = _ERROR.findall(_content(self.log))
        # the log of a job that could not start is left from an older run: do not use its errors
        if errors and cause(self.said, folder) not in _STATUSES.values():
            return f"pdrom: job {self.rule} failed: {errors[-1]}"
        return (
            f"pdrom: job {self.rule} failed while making {self.output}: {cause(self.said, folder)}"
            + crash(self.written(begun), self.log)
        )


def cause(said: str, folder: Path) -> str:
    """Return the reason why a job ended that wrote no error into its log.

    said : Snakemake's message about the failure, with the exit status or the signal
    folder : folder into which the job wrote; the reason may be that its disk is full
    """
    if any(words in said for words in _FULL) or shutil.disk_usage(folder).free < _FULL_DISK:
        return "no space left on the disk"
    if "MemoryError" in said:
        return "out of memory"
    if slurm := _SLURM_STATUS.search(said):
        return f"SLURM says {slurm['status'].lower().replace('_', ' ')}"
    found = _ENDING.search(said)
    if found is None:
        return "it ended without a word"
    status = int(found["status"] or 0)
    signals = {number.value + 128: number.name for number in signal.Signals}
    name = found["signal"] or signals.get(status, "")
    if name:
        return _CAUSES.get(name, f"crashed ({name})")
    return _STATUSES.get(status, f"exit status {status}, without a word")


def crash(written: str, log: str) -> str:
    """Code line of the crash that ``written``, the text of file ``log``, reports; empty if none."""
    found = list(_CRASH.finditer(written))
    if not found:
        return ""
    frames = list(_FRAME.finditer(found[-1]["frames"]))
    own = [f for f in frames if re.search("/src/(pdrom|study)/", f["file"])]
    frame = (own or frames)[0]
    return f" at {frame['file']}:{frame['line']} in {frame['function']} (log: {log})"


class Failures(logging.Handler):
    """Log handler that collects failed jobs, failed batches, and interruptions of a run."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._begun = time.time()
        self.jobs: list[Failure] = []
        self.batches: list[tuple[str, str]] = []
        self.other: list[str] = []
        self.stopped: str | None = None
        # thread -> its last error message: Snakemake logs the cause before it names the failed job
        self._said: dict[int | None, str] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Store the failed job, failed batch, error or interruption that a ``record`` reports."""
        event = getattr(record, "event", None)
        text = record.getMessage()
        if event == LogEvent.GROUP_ERROR:
            self.batches.append((record.groupid, next(iter(record.aux_logs), "")))
        elif event == LogEvent.JOB_ERROR:
            said = self._said.pop(record.thread, "") or getattr(record, "rule_msg", None) or ""
            files = (getattr(record, name, ()) for name in ("log", "output"))
            log, output = (next(iter(names), "") for names in files)
            failure = Failure(record.rule_name, log, output or "its result", said)
            # "indent" marks all jobs of a failed batch: store only those with an error in the log
            if not getattr(record, "indent", False) or _ERROR.search(failure.written(self._begun)):
                self.jobs.append(failure)
        elif event == LogEvent.ERROR:
            found = _IN_RULE.search(text)
            if found:
                self.other.append(f"pdrom: job {found['rule']}: {found['text']}")
            else:
                self._said[record.thread] = text
        elif event is None and _INTERRUPTED in text:
            self.stopped = self.stopped or "interrupted"

    def note_sigterm(self) -> None:
        """Store that the run ends because it received the signal SIGTERM."""
        self.stopped = "ended by SIGTERM"

    def end(self) -> tuple[str, int]:
        """Return the last lines of a failed run, and its exit status.

        They repeat each failed job's error, as Snakemake prints many lines after its own message.
        """
        lines = []
        for name, log in self.batches:  # failed batches of cluster jobs, and the log of each
            found = _BY_SLURM.search(_content(log))
            how = (found["why"] or found["status"]).lower() if found else "a job of it failed"
            lines.append(f"pdrom: batch {name} failed: {how} (log: {log})")
        lines += [job.line(self._begun) for job in self.jobs]
        if self.stopped:
            # do not list jobs that failed only because the run was ended
            lines = [line for line in lines if not line.endswith(tuple(_CAUSES.values()))]
            lines.append(f"pdrom: {self.stopped}")
        text = "\n".join([*dict.fromkeys([*lines, *self.other]), ADVICE]) + "\n"
        return text, INTERRUPTED if self.stopped else 1


def _content(path: str) -> str:
    """Return the text of a log file; empty if the file does not exist."""
    return Path(path).read_text(encoding="utf-8", errors="replace") if Path(path).is_file() else ""
