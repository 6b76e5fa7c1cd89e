"""The process of a run: alone in its folder, with dates that Snakemake takes, and with an end.

The lock belongs to the operating system and goes with the process, however that ends, so that it is
never stale. Snakemake's own lock consists of files, which a killed run leaves behind: whoever holds
the lock of the operating system may delete them.

Snakemake compares dates and refuses a result that is older than what it was made from, so that no
run would succeed after the clock was set back until it has passed the dates. At SIGTERM it would
wait for the jobs that run, for minutes.
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
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

import psutil

from pdrom.core.errors import INTERRUPTED, PdromError

FOLDER = Path(".snakemake")
LOCK = FOLDER / "run.lock"
SNAKEMAKE_LOCKS = FOLDER / "locks"
# Between two dates in the future that are moved to now.
STEP_NS = 10_000
# Seconds after which a job is killed that SIGTERM did not end.
PATIENCE = 5.0


class AtWorkError(PdromError):
    """Another process runs the workflow in this folder."""


def hold() -> int:
    """Hold the lock of the working directory until the process ends or closes the descriptor.

    Raises
    ------
    AtWorkError
        Naming the process that holds it, or the fault of the disk.
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
    """Delete what a killed run left of Snakemake's lock, unless somebody is at work."""
    if not SNAKEMAKE_LOCKS.is_dir():
        return
    try:
        os.close(hold())
    except AtWorkError:
        return


def settle_dates(folders: Iterable[str | Path]) -> int:
    """Move files in ``folders`` dated in the future to just before now; say and return how many.

    The order is kept: what was newer than something else, and makes it run again, still is. Of a
    link its own date is moved: what it leads to may lie elsewhere.
    """
    now = time.time_ns()
    files = [path for folder in folders for path in Path(folder).rglob("*") if path.is_file()]
    future = {path: date for path in files if (date := path.lstat().st_mtime_ns) > now}
    ranks = {date: rank for rank, date in enumerate(sorted(set(future.values()), reverse=True))}
    for path, date in future.items():
        settled = now - ranks[date] * STEP_NS
        os.utime(path, ns=(settled, settled), follow_symlinks=False)
    if future:
        sys.stderr.write(f"pdrom: {len(future)} files were dated in the future (clock set back?)\n")
    return len(future)


def end_at_sigterm() -> None:
    """Let SIGTERM end this process with one line, while no job runs."""

    def end(number: int, frame: object) -> None:
        _say(b"pdrom: ended by SIGTERM\n")
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGTERM, end)


def stop_at_sigterm(note: Callable[[], None]) -> None:
    """Let SIGTERM end all jobs, and then the run as Ctrl-C does; ``note`` is called."""

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
