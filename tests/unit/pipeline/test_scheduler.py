"""Timers of Snakemake's rate limit end with the run; other timers and threads go on."""

import threading

from snakemake.scheduling import job_scheduler

from pdrom.pipeline.scheduler import cancel_timers


class _Scheduler:
    """Stands for Snakemake's scheduler, whose own method starts the timers."""

    def __init__(self) -> None:
        self._open_jobs = threading.Semaphore(0)


def test_only_the_timers_of_the_rate_limit_are_cancelled():
    scheduler = _Scheduler()
    before = set(threading.enumerate())
    for _ in range(3):
        job_scheduler.JobScheduler._schedule_reevalutation(scheduler, 60.0)
    limits = set(threading.enumerate()) - before
    fired = threading.Event()
    other = threading.Timer(60.0, fired.set)
    other.start()
    cancel_timers()
    for timer in limits:
        timer.join(timeout=10.0)
        assert not timer.is_alive()
    assert len(limits) == 3
    assert not scheduler._open_jobs.acquire(blocking=False)
    assert not other.finished.is_set()
    other.cancel()
    other.join(timeout=10.0)
    assert not fired.is_set()
