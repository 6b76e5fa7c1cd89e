"""Report printed at the end of a failed run: every failed job with the cause of the failure."""

import logging
import re
import signal
import sys
import threading
import time
from pathlib import Path

from snakemake_interface_logger_plugins.common import LogEvent

from pdrom.core.errors import PdromError
from study.pipeline.fork_server.client import GONE
from study.pipeline.running import blocked
from study.pipeline.signals import ENDINGS, KEPT, ending

ADVICE = f"pdrom: {KEPT}"

_ERROR = re.compile(r"^[-0-9]+ [0-9:,]+ ERROR +pdrom: (.*)$", re.MULTILINE)
_ENDING = re.compile(r"died with <Signals\.\w+: (?P<signal>\d+)|exit status (?P<status>\d+)")
# Message of SLURM in the log of a batch of jobs, if SLURM cancelled the batch.
_BY_SLURM = re.compile(r"\*\*\* JOB \S+ ON \S+ (CANCELLED) AT \S+(?: DUE TO ([A-Z ]+?))? \*\*\*")
# Part of the error message of Snakemake's SLURM executor about a failed job.
_SLURM_STATUS = re.compile(r"SLURM status is: '(\w+)'")


def cause(said: str, log: str) -> str:
    """Return the reason why a job ended that wrote no error into its ``log``.

    ``said`` is Snakemake's message about the failure, with the exit status or the signal.
    """
    if "No space left on device" in said:
        return "no space left on the disk"
    if slurm := _SLURM_STATUS.search(said):
        return f"SLURM says {slurm[1].lower().replace('_', ' ')}"
    if not (found := _ENDING.search(said)):
        return f"it ended without an error message, see {log}"
    status = int(found["status"] or 0)
    number = int(found["signal"] or status - 128)
    if status == GONE:
        return "the process that jobs start from is gone: out of memory?"
    if number == signal.SIGKILL:
        return "killed (SIGKILL): out of memory?"
    if number not in {*signal.Signals}:
        return f"exit status {status}, see {log}"
    name = signal.Signals(number)
    return ENDINGS.get(name, f"crashed ({name.name}), see {log}")


class Failures(logging.Handler):
    """Log handler that collects failed jobs, failed batches, and interruptions of a run."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._begun = time.time() - 1.0  # dates of files may lag behind the clock
        self._lines: list[str] = []
        self._stopped: int | None = None
        # thread -> its last error message: Snakemake logs the cause before it names the failed job
        self._said: dict[int | None, str] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Store the failed job, failed batch, error or interruption that a ``record`` reports."""
        event, text = getattr(record, "event", None), record.getMessage()
        if event == LogEvent.GROUP_ERROR:
            log = next(iter(record.aux_logs), "")
            found = _BY_SLURM.search(self._written(log))
            how = (found[2] or found[1]).lower() if found else "a job of it failed"
            self._lines.append(f"pdrom: batch {record.groupid} failed: {how} (log: {log})")
        elif event == LogEvent.JOB_ERROR:
            said = self._said.pop(record.thread, "") or record.rule_msg or ""
            log, output = record.log[0], record.output[0]
            job = f"pdrom: job {record.rule_name}"
            if errors := _ERROR.findall(self._written(log)):
                self._lines.append(f"{job} failed: {errors[-1]}")
            elif not record.indent:  # all jobs of a failed batch are indented, finished ones, too
                why = cause(said, log)
                self._lines.append(f"{job} failed while making {output}: {why}")
        elif event == LogEvent.ERROR:
            self._said[record.thread] = text

    def note(self, number: int) -> None:
        """Store that the run ends because it received the signal ``number``."""
        self._stopped = number

    def end(self) -> tuple[str, int]:
        """Return the last lines of a failed run, with each failed job's error, and exit status."""
        if self._stopped:  # jobs that failed meanwhile were ended, too
            return ending(self._stopped), 128 + self._stopped
        return "\n".join([*dict.fromkeys(self._lines), ADVICE]) + "\n", 1

    def _written(self, log: str) -> str:
        """Text of the file ``log``; empty if this run has not written the file."""
        path = Path(log)
        if not path.is_file() or path.stat().st_mtime < self._begun:
            return ""
        return path.read_text(encoding="utf-8", errors="replace")


def plain(record: logging.LogRecord) -> bool:
    """Filter of Snakemake's log: an error outside of jobs becomes one line, without a traceback."""
    error = sys.exc_info()[1]
    outside = threading.current_thread() is threading.main_thread()
    if getattr(record, "event", None) == LogEvent.ERROR and error and outside:
        text = blocked(error) if isinstance(error, OSError) else str(error)
        kind = "" if " " in text else f"{type(error).__name__}: "
        line = " ".join(f"{kind}{text}".split())
        record.msg, record.args = f"pdrom: {PdromError(line[:600])} (--verbose shows more)", ()
    return True
