"""What Snakemake's scheduler leaves behind at the end of a run."""

import threading

SCHEDULER = "snakemake.scheduling.job_scheduler"


def cancel_timers() -> None:
    """Cancel the timers of Snakemake's rate limit, which would make it choose jobs once more.

    Snakemake starts such a timer after every choice, and the process would not end before the last
    one has run out. Timers that anything else has started go on.
    """
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer) and _module(thread) == SCHEDULER:
            thread.cancel()


def _module(timer: threading.Timer) -> str:
    return getattr(timer.function, "__module__", "")
