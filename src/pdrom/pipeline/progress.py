"""What a run shows while it goes on: one line a job, with counts and the time that is left."""

import logging
import sys
import time
from collections import Counter, defaultdict

from snakemake_interface_logger_plugins.common import LogEvent

NOTHING = "Nothing to be done"
# What Snakemake says of a failed job, which the last lines of the run name with its cause.
JOB_FAULT = "RuleException"
CLOSING = "At least one job did not complete successfully"
# Share of the jobs that must be done before their times say something about the others.
ENOUGH = 0.05


class Estimate:
    """Seconds that a run still takes, by the mean time of the finished jobs of each rule."""

    def __init__(self) -> None:
        self.planned: Counter[str] = Counter()
        self._running: dict[int, tuple[str, float]] = {}
        self._times: defaultdict[str, list[float]] = defaultdict(list)
        self._begin: float | None = None

    def start(self, job: int, rule: str, now: float) -> None:
        """A job starts, at ``now`` in seconds."""
        self._begin = now if self._begin is None else self._begin
        self._running[job] = (rule, now)

    def finish(self, job: int, now: float) -> None:
        """A job has ended."""
        rule, start = self._running.pop(job, ("", now))
        self._times[rule].append(now - start)

    def left(self, now: float) -> float | None:
        """Seconds that are left; None while too few jobs are done."""
        times = [seconds for rule in self._times.values() for seconds in rule]
        total = sum(self.planned.values())
        if self._begin is None or not times or len(times) < ENOUGH * total:
            return None
        mean = sum(times) / len(times)
        work = 0.0
        for rule, count in self.planned.items():
            done = self._times.get(rule, [])
            work += (count - len(done)) * (sum(done) / len(done) if done else mean)
        at_once = sum(times) / max(now - self._begin, 1e-9)
        return max(work, 0.0) / max(at_once, 1.0)


class Progress(logging.Handler):
    """Writes a line for each job that starts, and what Snakemake warns of."""

    def start(self, plans: bool = False) -> None:
        """Nothing was seen yet; of a dry run, which ``plans``, no job is shown."""
        self._plans = plans
        self._started = 0
        self._messages: dict[int, str] = {}
        self._estimate = Estimate()

    def emit(self, record: logging.LogRecord) -> None:
        """Show what a user wants to see of a record."""
        event = getattr(record, "event", None)
        if event == LogEvent.RUN_INFO:
            counts = {r: n for r, n in record.stats.items() if r != "total"}
            self._estimate.planned = Counter(counts)
        elif event == LogEvent.JOB_INFO:
            if not self._plans:
                self._show_job(record)
        elif event == LogEvent.JOB_FINISHED:
            self._estimate.finish(record.job_id, record.created)
        elif event == LogEvent.GROUP_ERROR:
            self._write(record, f"FAILED: batch {record.groupid}")
        elif event == LogEvent.JOB_ERROR and not getattr(record, "indent", False):
            what = self._messages.get(record.jobid, record.rule_name)
            self._write(record, f"FAILED: {what}")
        elif _is_news(record, event):
            sys.stderr.write(record.getMessage() + "\n")

    def _show_job(self, record: logging.LogRecord) -> None:
        self._started += 1
        what = record.rule_msg or record.rule_name
        self._messages[record.jobid] = what
        left = self._estimate.left(record.created)
        self._estimate.start(record.jobid, record.rule_name, record.created)
        self._write(record, what + (f"   {rounded(left)} left" if left is not None else ""))

    def _write(self, record: logging.LogRecord, text: str) -> None:
        total = str(sum(self._estimate.planned.values()))
        clock = time.strftime("%H:%M", time.localtime(record.created))
        sys.stderr.write(f"[{self._started:>{len(total)}}/{total}] {clock} {text}\n")


def _is_news(record: logging.LogRecord, event: LogEvent | None) -> bool:
    """Whether a message is shown as it is: warnings, and faults before the first job."""
    text = record.getMessage()
    if event == LogEvent.ERROR:
        return record.exception != JOB_FAULT and CLOSING not in text
    return event is None and (record.levelno >= logging.WARNING or NOTHING in text)


def rounded(seconds: float) -> str:
    """A time in words, as roughly as it is known."""
    if seconds < 60:
        return "less than a minute"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"about {minutes} min"
    return f"about {minutes / 60:.1f} h"
