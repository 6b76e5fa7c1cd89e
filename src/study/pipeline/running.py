"""Lock the folder of a run, so that no second run starts there.

The operating system releases this lock when the process ends. Snakemake's lock consists of files,
which a killed run leaves behind; the next run deletes them.
"""

import fcntl
import os
import shutil
import socket
from pathlib import Path

from pdrom.core.errors import PdromError

FOLDER = Path(".snakemake")
LOCK = FOLDER / "run.lock"
SNAKEMAKE_LOCKS = FOLDER / "locks"


def hold() -> int:
    """Lock the working directory until the process ends; return the descriptor of the lock file.

    Raises PdromError if another process holds the lock (named in the message), or OSError.
    """
    try:
        FOLDER.mkdir(exist_ok=True)
        descriptor = os.open(LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if SNAKEMAKE_LOCKS.is_dir():
            shutil.rmtree(SNAKEMAKE_LOCKS)
    except BlockingIOError:
        holder = os.read(descriptor, 300).decode(errors="replace").strip()
        os.close(descriptor)
        raise PdromError(
            f"another run ({holder or 'just started'}) uses this folder; wait until it ends "
            "(-n works meanwhile)"
        ) from None
    os.ftruncate(descriptor, 0)
    os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
    return descriptor
