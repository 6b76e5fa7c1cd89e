"""Logger for Snakemake's option ``--logger pdrom``; Snakemake finds it by this package's name."""

import logging
import sys
import time

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

# Beginnings of messages that are printed: there are no jobs; why jobs would run.
NEWS = ("Nothing to be done", "Reasons:")
ENOUGH = 0.05  # share of the work in finished jobs that an estimate needs


class LogHandler(LogHandlerBase):
    """Log handler that prints one line for each started or failed job, and Snakemake's warnings.

    It prints to standard error. Snakemake's other messages are in its log only. Of a dry run, it
    prints the numbers of jobs and the reasons.
    """

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = True
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self._started = self._total = 0
        self._rest: dict[int, float] = {}  # number of a job -> its expected processor seconds
        self._work = self._begun = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Print a ``record`` about a job or problem; update the estimate of remaining time."""
        event, text = getattr(record, "event", None), record.getMessage()
        news = event is None and (record.levelno >= logging.WARNING or text.startswith(NEWS))
        if event == LogEvent.RUN_INFO:
            news = self.common_settings.dryrun and not self._total  # a dry run repeats it
            self._total = record.stats["total"]
        elif hasattr(record, "expected"):
            self._rest, self._begun = dict(record.expected), record.created
            self._work = sum(self._rest.values())
        elif event == LogEvent.JOB_INFO and not self.common_settings.dryrun:
            self._started += 1
            self._write(record, f"{record.rule_msg or record.rule_name}{self._done(record)}")
        elif event == LogEvent.JOB_FINISHED:
            self._rest.pop(record.job_id, None)
        elif event == LogEvent.GROUP_ERROR:
            self._write(record, f"FAILED: batch {record.groupid}")
        elif event == LogEvent.JOB_ERROR and not getattr(record, "indent", False):
            self._write(record, f"FAILED: {record.rule_msg or record.rule_name}")
        elif event == LogEvent.ERROR:  # the last lines of a run report all failed jobs
            news = record.exception != "RuleException"
        if news:
            sys.stderr.write(text + "\n")

    def _done(self, record: logging.LogRecord) -> str:
        """Share of the work that is done, and the time left if it goes on as until now; or ""."""
        done = self._work - sum(self._rest.values())
        if done <= 0.0 or done < ENOUGH * self._work:
            return ""
        left = (record.created - self._begun) * (self._work / done - 1.0)
        return f"   {done / self._work:.0%} done, {rounded(left)} left"

    def _write(self, record: logging.LogRecord, text: str) -> None:
        total = str(self._total)
        clock = time.strftime("%H:%M", time.localtime(record.created))
        sys.stderr.write(f"[{self._started:>{len(total)}}/{total}] {clock} {text}\n")


def rounded(seconds: float) -> str:
    """Return ``seconds`` as a rounded duration in words, such as "about 2.5 min"."""
    minutes = seconds / 60
    if minutes < 1:
        return "less than a minute"
    if minutes < 90:
        return f"about {round(minutes) if minutes > 5 else round(2 * minutes) / 2:g} min"
    return f"about {minutes / 60:.1f} h"
