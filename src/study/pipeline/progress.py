"""Progress of a run: one line a job, with counts and the time that is left."""

import logging
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import accumulate

from snakemake_interface_logger_plugins.common import LogEvent

NOTHING = "Nothing to be done"
# What Snakemake says of a failed job, which the last lines of the run name with its cause.
JOB_FAULT = "RuleException"
CLOSING = "At least one job did not complete successfully"
# Jobs, and share of the expected work, that must be done before the time that is left is reported.
ENOUGH_JOBS, ENOUGH = 2, 0.05
# Share of its expected time that a job is taken to need still, however long it has been running.
REST = 0.1


@dataclass
class Expected:
    """Job of a run, as expected on the machine where jobs were measured, and as it ran.

    seconds : of the job
    share : of this machine that it claims, 1 where there is no limit
    after : seconds of the longest chain of jobs that wait for it
    start, end : seconds of the clock at which it started and ended, None before
    """

    seconds: float
    share: float
    after: float
    start: float | None = None
    end: float | None = None

    def ran(self, now: float) -> float:
        """Seconds that it ran."""
        return 0.0 if self.start is None else (now if self.end is None else self.end) - self.start

    def rest(self, now: float, slower: float) -> float:
        """Seconds that it still takes where jobs take ``slower`` times what is expected."""
        expected = self.seconds * slower
        return 0.0 if self.end is not None else max(expected - self.ran(now), REST * expected)


class Estimate:
    """Seconds that a run of ``jobs``, by their numbers, still takes.

    Finished jobs say how much longer jobs take than expected: the median of these quotients,
    weighted by work, so that the few which compile kernels do not count. What all jobs together
    claimed until now says how busy the machine is kept.
    """

    def __init__(self, jobs: Mapping[int, Expected]) -> None:
        self._jobs = jobs

    def start(self, job: int, now: float) -> None:
        """Note that ``job`` starts at the time ``now``, s."""
        if job in self._jobs:
            self._jobs[job].start = now

    def finish(self, job: int, now: float) -> None:
        """Note that ``job`` has ended at the time ``now``, s."""
        if job in self._jobs:
            self._jobs[job].end = now

    def left(self, now: float) -> float | None:
        """Seconds that are left at the time ``now``, s; None while too little is done."""
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
    """Median of values with weights."""
    ordered = sorted(weighted)
    half = sum(weight for _, weight in ordered) / 2
    below = accumulate(weight for _, weight in ordered)
    return next(value for (value, _), sum_ in zip(ordered, below, strict=True) if sum_ >= half)


class Progress(logging.Handler):
    """Writes a line for each job that starts, and what Snakemake warns of."""

    def start(self, plans: bool = False) -> None:
        """Begin with nothing seen; of a dry run, which ``plans``, no job is shown."""
        self._plans = plans
        self._started = self._total = 0
        self._messages: dict[int, str] = {}
        self._estimate = Estimate({})

    def emit(self, record: logging.LogRecord) -> None:
        """Show what a user wants to see of a record."""
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
    """Whether a message is shown as it is: warnings, and faults before the first job."""
    text = record.getMessage()
    if event == LogEvent.ERROR:
        return record.exception != JOB_FAULT and CLOSING not in text
    return event is None and (record.levelno >= logging.WARNING or NOTHING in text)


def rounded(seconds: float) -> str:
    """Time of so many ``seconds`` in words, as roughly as it is known."""
    minutes = seconds / 60
    if minutes < 1:
        return "less than a minute"
    if minutes < 90:
        return f"about {round(minutes) if minutes > 5 else round(2 * minutes) / 2:g} min"
    return f"about {minutes / 60:.1f} h"
