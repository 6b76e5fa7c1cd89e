"""Report the failed jobs at the end of a failed run, each with the cause of its failure."""

import logging
import re
from pathlib import Path

from snakemake_interface_logger_plugins.common import LogEvent

from study.pipeline.signals import KEPT

_ERROR = re.compile(r"^[-0-9]+ [0-9:,]+ ERROR +pdrom: (.*)$", re.MULTILINE)


class Failures(logging.Handler):
    """Log handler that collects failed jobs and failed batches of a run."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._lines: list[str] = []
        # thread -> its last error message: Snakemake logs the cause before it names the failed job
        self._said: dict[int | None, str] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Store the failed job, failed batch or error that a ``record`` reports."""
        event = getattr(record, "event", None)
        if event == LogEvent.ERROR:
            self._said[record.thread] = " ".join(record.getMessage().split())
        elif event == LogEvent.GROUP_ERROR:
            log = next(iter(record.aux_logs), "")
            last = written(log).strip().rpartition("\n")[2]
            self._lines.append(f"batch {record.groupid} failed: {last} (log: {log})")
        elif event == LogEvent.JOB_ERROR:
            said, log = self._said.pop(record.thread, ""), record.log[0]
            if errors := _ERROR.findall(written(log)):
                self._lines.append(f"job {record.rule_name} failed: {errors[-1]}")
            elif not record.indent:  # Snakemake indents all jobs of a failed batch, even finished
                made = f"job {record.rule_name} failed while making {record.output[0]}"
                self._lines.append(f"{made}: {said} (log: {log})")

    def text(self) -> str:
        """Return the last lines of a failed run: each failed job with its error."""
        return "".join(f"pdrom: {line}\n" for line in dict.fromkeys([*self._lines, KEPT]))


def written(log: str) -> str:
    """Return the text of the file ``log``; "" if it is missing, as when its job has just begun."""
    path = Path(log)
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
