"""Logger for Snakemake's option ``--logger pdrom``; Snakemake finds it by this package's name."""

import logging
import sys
import time

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from study.pipeline.progress import Estimate

NOTHING = "Nothing to be done"


class LogHandler(LogHandlerBase):
    """Log handler that prints one line for each started or failed job, and Snakemake's warnings.

    It prints to standard error. Snakemake's other messages are in its log only. In a dry run, no
    jobs are printed.
    """

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = True
    needs_rulegraph = False

    def __post_init__(self) -> None:
        self._started = self._total = 0
        self._estimate = Estimate({}, 0.0)

    def emit(self, record: logging.LogRecord) -> None:
        """Print a ``record`` about a job or problem; update the estimate of remaining time."""
        event, text = getattr(record, "event", None), record.getMessage()
        news = event is None and (record.levelno >= logging.WARNING or NOTHING in text)
        if event == LogEvent.RUN_INFO:
            self._total = record.stats["total"]
        elif hasattr(record, "expected"):
            self._estimate = Estimate(record.expected, record.created)
        elif event == LogEvent.JOB_INFO and not self.common_settings.dryrun:
            self._started += 1
            what = record.rule_msg or record.rule_name
            self._write(record, what + self._estimate.words(record.created))
        elif event == LogEvent.JOB_FINISHED:
            self._estimate.finish(record.job_id)
        elif event == LogEvent.GROUP_ERROR:
            self._write(record, f"FAILED: batch {record.groupid}")
        elif event == LogEvent.JOB_ERROR and not getattr(record, "indent", False):
            self._write(record, f"FAILED: {record.rule_msg or record.rule_name}")
        elif event == LogEvent.ERROR:  # the last lines of a run report all failed jobs
            news = record.exception != "RuleException"
        if news:
            sys.stderr.write(text + "\n")

    def _write(self, record: logging.LogRecord, text: str) -> None:
        total = str(self._total)
        clock = time.strftime("%H:%M", time.localtime(record.created))
        sys.stderr.write(f"[{self._started:>{len(total)}}/{total}] {clock} {text}\n")
