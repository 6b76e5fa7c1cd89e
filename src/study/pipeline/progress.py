"""Progress of a run: one line per job, with counts and an estimate of the remaining time."""

import logging
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate

from snakemake_interface_logger_plugins.common import LogEvent

NOTHING = "Nothing to be done"
# Part of Snakemake's message about a failed job; the run's last lines report such jobs instead.
JOB_FAULT = "RuleException"
CLOSING = "At least one job did not complete successfully"
# Least number of jobs, and least share of the expected work, done before an estimate is shown.
ENOUGH_JOBS, ENOUGH = 2, 0.05
# Least remaining time of an unfinished job, as a share of its expected time.
REST = 0.1


@dataclass
class Expected:
    """Expected and measured time of a job.

    seconds : expected duration of the job
    share : share of this machine's cores that the job claims; 1 on a cluster
    after : expected seconds of the longest chain of jobs that wait for this job
    start, end : times in s at which it started and ended; None before
    """

    seconds: float
    share: float
    after: float
    start: float | None = None
    end: float | None = None

    def ran(self, now: float) -> float:
        """Return the seconds that the job has run until its end or until ``now``."""
        return 0.0 if self.start is None else (now if self.end is None else self.end) - self.start

    def rest(self, now: float, slower: float) -> float:
        """Return the job's remaining seconds if jobs take ``slower`` times their expected time."""
        expected = self.seconds * slower
        return 0.0 if self.end is not None else max(expected - self.ran(now), REST * expected)


class Estimate:
    """Estimate of the remaining seconds of a run of ``jobs``, by job number.

    The slowdown of this machine is the median quotient of measured and expected times of finished
    jobs, weighted by expected time, so that the few jobs which compile kernels have little effect.
    The degree of parallel work follows from the time that all jobs have claimed until now.
    """

    def __init__(self, jobs: Mapping[int, Expected]) -> None:
        self._jobs = jobs

    def start(self, job: int, now: float) -> None:
        """Record that ``job`` starts at the time ``now``, s."""
        if job in self._jobs:
            self._jobs[job].start = now

    def finish(self, job: int, now: float) -> None:
        """Record that ``job`` has ended at the time ``now``, s."""
        if job in self._jobs:
            self._jobs[job].end = now

    def left(self, now: float) -> float | None:
        """Return the remaining seconds at the time ``now``, s; None while too few jobs are done."""
        begun = [job for job in self._jobs.values() if job.start is not None]
        done = [job for job in begun if job.end is not None]
        total = sum(job.seconds for job in self._jobs.values())
        finished = sum(job.seconds for job in done)
        if len(done) < ENOUGH_JOBS or finished < ENOUGH * total:
            return None
        slower = _median((job.ran(now) / job.seconds, job.seconds) for job in done)
        rests = [(job, job.rest(now, slower)) for job in self._jobs.values() if job.end is None]
        work = sum(rest * job.share for job, rest in rests)
        busy = sum(job.ran(now) * job.share for job in begun)
        idle = (now - min(job.start or 0.0 for job in begun)) / busy
        chain = max((rest + job.after * slower for job, rest in rests), default=0.0)
        return max(work * idle, chain)


def _median(weighted: Iterable[tuple[float, float]]) -> float:
    """Weighted median of (value, weight) pairs."""
    ordered = sorted(weighted)
    half = sum(weight for _, weight in ordered) / 2
    below = accumulate(weight for _, weight in ordered)
    return next(value for (value, _), sum_ in zip(ordered, below, strict=True) if sum_ >= half)


class Progress(logging.Handler):
    """Log handler that prints a line for each started or failed job, and Snakemake's warnings."""

    def start(self, plans: bool = False) -> None:
        """Reset all counts; in a dry run (``plans`` is True) no jobs are printed."""
        self._plans = plans
        self._started = self._total = 0
        self._messages: dict[int, str] = {}
        self._estimate = Estimate({})

    def emit(self, record: logging.LogRecord) -> None:
        """Print the part of a log ``record`` that concerns the user, and update the estimate."""
        event = getattr(record, "event", None)
        if event == LogEvent.RUN_INFO:
            self._total = record.stats["total"]
        elif hasattr(record, "expected"):
            self._estimate = Estimate(record.expected)
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
        self._estimate.start(record.jobid, record.created)
        self._write(record, what + (f"   {rounded(left)} left" if left is not None else ""))

    def _write(self, record: logging.LogRecord, text: str) -> None:
        total = str(self._total)
        clock = time.strftime("%H:%M", time.localtime(record.created))
        sys.stderr.write(f"[{self._started:>{len(total)}}/{total}] {clock} {text}\n")


def _is_news(record: logging.LogRecord, event: LogEvent | None) -> bool:
    """Return whether a message is printed unchanged: a warning, or an error outside of jobs."""
    text = record.getMessage()
    if event == LogEvent.ERROR:
        return record.exception != JOB_FAULT and CLOSING not in text
    return event is None and (record.levelno >= logging.WARNING or NOTHING in text)


def rounded(seconds: float) -> str:
    """Return a duration of ``seconds`` in words, rounded to the accuracy of the estimate."""
    minutes = seconds / 60
    if minutes < 1:
        return "less than a minute"
    if minutes < 90:
        return f"about {round(minutes) if minutes > 5 else round(2 * minutes) / 2:g} min"
    return f"about {minutes / 60:.1f} h"
