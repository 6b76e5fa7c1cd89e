"""The process of a run: it locks its folder, and ends at SIGTERM.

The operating system releases the lock when the process ends, for whatever reason. Snakemake's own
lock consists of files, which a killed run leaves behind: a process that has the operating system's
lock deletes them.

At SIGTERM, running jobs are ended, too, since Snakemake would wait for them for minutes.
"""

import errno
import fcntl
import os
import shutil
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil

from pdrom.core.errors import PdromError

FOLDER = Path(".snakemake")
LOCK = FOLDER / "run.lock"
SNAKEMAKE_LOCKS = FOLDER / "locks"
# Jobs that still run this number of seconds after SIGTERM are killed.
PATIENCE = 5.0


class AtWorkError(PdromError):
    """Raised if another process runs the workflow in this folder, or the lock file is unusable."""


def hold() -> int:
    """Lock the working directory until the process ends; return the descriptor of the lock file.

    Raises AtWorkError if the lock is unusable or held by another process (named in the message).
    """
    try:
        FOLDER.mkdir(exist_ok=True)
        descriptor = os.open(LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise AtWorkError(f"{LOCK}: cannot be written ({error.strerror})") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        holder = os.read(descriptor, 300).decode(errors="replace").strip()
        os.close(descriptor)
        if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
            raise AtWorkError(f"{LOCK}: cannot be locked ({error.strerror})") from error
        at_work = f"another run ({holder or 'just started'}) is at work in this folder"
        raise AtWorkError(f"{at_work}; wait for its end, -n works meanwhile") from None
    os.ftruncate(descriptor, 0)
    os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
    shutil.rmtree(SNAKEMAKE_LOCKS, ignore_errors=True)
    return descriptor


def remove_stale_locks() -> None:
    """Delete the lock files that a killed run of Snakemake left, unless a run is at work."""
    if SNAKEMAKE_LOCKS.is_dir():
        with suppress(AtWorkError):
            os.close(hold())


def stop_at_sigterm(note: Callable[[], None]) -> None:
    """Install a handler of SIGTERM: call ``note``, end all jobs, end the run as Ctrl-C does."""

    def stop(number: int, frame: object) -> None:
        with suppress(OSError):  # nobody may read the stream any more
            os.write(sys.stderr.fileno(), b"pdrom: SIGTERM: ending the jobs that run\n")
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        note()
        threading.Thread(target=_end_jobs, daemon=True).start()
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)


def _end_jobs() -> None:
    """End the processes of all jobs, repeatedly until this process ends: jobs may still start."""
    begin, own = time.monotonic(), psutil.Process()
    while True:
        late = time.monotonic() - begin > PATIENCE
        for process in own.children(recursive=True):
            with suppress(psutil.Error, ProcessLookupError):
                # spare the fork server, whose session differs: it ends jobs whose client is dead
                if os.getsid(process.pid) == os.getsid(0):
                    process.send_signal(signal.SIGKILL if late else signal.SIGTERM)
        time.sleep(0.5)
