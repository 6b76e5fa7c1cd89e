"""One run at a time in a folder, by whatever command it was started.

The lock belongs to the operating system and goes with the process, however that ends, so that it is
never stale. Snakemake's own lock consists of files, which a killed run leaves behind: whoever holds
the lock of the operating system may delete them.
"""

import errno
import fcntl
import os
import shutil
import socket
from pathlib import Path

from pdrom.core.errors import PdromError

FOLDER = Path(".snakemake")
LOCK = FOLDER / "run.lock"
SNAKEMAKE_LOCKS = FOLDER / "locks"


class AtWorkError(PdromError):
    """Another process runs the workflow in this folder."""


def hold() -> int:
    """Hold the lock of the working directory until the process ends or closes the descriptor.

    Raises
    ------
    AtWorkError
        Naming the process that holds it, or the fault of the disk.
    """
    descriptor = _open()
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


def _open() -> int:
    try:
        FOLDER.mkdir(exist_ok=True)
        return os.open(LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise AtWorkError(f"{LOCK}: cannot be written ({error.strerror})") from error
