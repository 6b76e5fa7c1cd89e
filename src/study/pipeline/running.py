"""The process of a run: it locks its folder, and ends at signals with one line.

Snakemake's own lock consists of files, which a killed run leaves behind: a process that has the
operating system's lock deletes them. At a signal, running jobs are ended, too, since Snakemake
would wait for them for minutes.
"""

import errno
import fcntl
import os
import shutil
import signal
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil

from pdrom.core.errors import PdromError, reason
from study.pipeline.signals import handle

FOLDER = Path(".snakemake")
LOCK = FOLDER / "run.lock"
SNAKEMAKE_LOCKS = FOLDER / "locks"
# Jobs that still run this number of seconds after a signal are killed.
PATIENCE = 5.0


def blocked(error: OSError) -> str:
    """Return what the operating system refused, and what to do about it."""
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    do = "make room" if full else "remove what stands there, or make it writable"
    return f"{error.filename or 'a file'}: {reason(error)}; {do}"


def hold() -> int:
    """Lock the working directory until the process ends; return the descriptor of the lock file.

    Raises PdromError if the lock is unusable or held by another process (named in the message).
    """
    try:
        FOLDER.mkdir(exist_ok=True)
        descriptor = os.open(LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if SNAKEMAKE_LOCKS.is_dir():
            shutil.rmtree(SNAKEMAKE_LOCKS)
        SNAKEMAKE_LOCKS.unlink(missing_ok=True)
    except BlockingIOError:
        holder = os.read(descriptor, 300).decode(errors="replace").strip()
        os.close(descriptor)
        raise PdromError(
            f"another run ({holder or 'just started'}) is at work in this folder; wait for its "
            "end, -n works meanwhile"
        ) from None
    except OSError as error:
        raise PdromError(f"{LOCK}: cannot be written or locked; {blocked(error)}") from error
    os.ftruncate(descriptor, 0)
    os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
    return descriptor


def stop(note: Callable[[int], None]) -> Callable[[int, object], None]:
    """Return a handler of signals while jobs run: call ``note``, end all jobs, then the run."""

    def handler(number: int, _frame: object) -> None:
        handle(signal.SIG_IGN)
        note(number)
        threading.Thread(target=_end_jobs, daemon=True).start()
        raise KeyboardInterrupt  # Snakemake waits for its jobs, and reports a failed run

    return handler


def _end_jobs() -> None:
    """End the processes of all jobs, repeatedly until this process ends: jobs may still start."""
    begin, own = time.monotonic(), psutil.Process()
    while True:
        time.sleep(0.5)  # jobs that Ctrl-C has reached, too, remove their unfinished files
        late = time.monotonic() - begin > PATIENCE
        for process in own.children(recursive=True):
            with suppress(psutil.Error, ProcessLookupError):
                # spare the fork server, whose session differs: it ends jobs whose client is dead
                if os.getsid(process.pid) == os.getsid(0):
                    process.send_signal(signal.SIGKILL if late else signal.SIGTERM)
