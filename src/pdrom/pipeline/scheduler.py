"""What Snakemake's scheduler leaves behind at the end of a run."""

import threading


def cancel_timers() -> None:
    """Cancel the timers that would make the scheduler choose jobs once more.

    It starts one of the rate limit's length after every choice, and the process would wait for the
    last of them.
    """
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.cancel()
