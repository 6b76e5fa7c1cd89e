"""What SIGTERM does to a run: it is said at once, and the run ends with its jobs within seconds.

Snakemake itself would wait for the jobs that run, for minutes.
"""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

import psutil

from pdrom.core.logs import INTERRUPTED

# Seconds after which a job is killed that SIGTERM did not end.
PATIENCE = 5.0


def end_at_sigterm() -> None:
    """While no job runs: SIGTERM ends this process with one line."""

    def end(number: int, frame: object) -> None:
        _say(b"pdrom: ended by SIGTERM\n")
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGTERM, end)


def stop_at_sigterm(note: Callable[[], None]) -> None:
    """While jobs run: SIGTERM ends them, and then the run as Ctrl-C does; ``note`` is called."""

    def stop(number: int, frame: object) -> None:
        _say(b"pdrom: SIGTERM: ending the jobs that run\n")
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        note()
        threading.Thread(target=_end_jobs, daemon=True).start()
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)


def _say(line: bytes) -> None:
    """Write to standard error, unless nobody reads it any more."""
    with suppress(OSError):
        os.write(sys.stderr.fileno(), line)


def _end_jobs() -> None:
    """End the processes of jobs until this process ends, also those that just begin."""
    begin, own = time.monotonic(), psutil.Process()
    while True:
        late = time.monotonic() - begin > PATIENCE
        for process in own.children(recursive=True):
            with suppress(psutil.Error, ProcessLookupError):
                # the fork server has a session of its own and ends forks with their clients
                if os.getsid(process.pid) == os.getsid(0):
                    process.send_signal(signal.SIGKILL if late else signal.SIGTERM)
        time.sleep(0.5)
