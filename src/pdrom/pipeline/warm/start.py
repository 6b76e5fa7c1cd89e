"""Starting the server, and the command that the workflow starts scripts with."""

import os
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from pdrom.pipeline.warm.client import ADDRESS

# Forks of a process that has loaded system frameworks are unsafe on macOS.
SUPPORTED = sys.platform == "linux"

# Third-party libraries that most jobs need.
LIBRARIES = (
    "h5py",
    "numba",
    "numpy",
    "pandas",
    "pydantic",
    "scipy.linalg",
    "scipy.sparse.linalg",
    "snakemake.iocontainers",
    "snakemake.script",
    "threadpoolctl",
    "yaml",
)


def interpreter(python: str = sys.executable) -> str:
    """Words of a shell that run a script by the client; ``python`` is the plain interpreter."""
    client = Path(__file__).with_name("client.py")
    return f"{shlex.quote(python)} -I -S {shlex.quote(str(client))}"


def start_server(python: str = sys.executable, libraries: Sequence[str] = LIBRARIES) -> None:
    """Start the server of this process; it ends when this process does.

    The address goes into the environment, which jobs inherit. Clients that come before the
    libraries are loaded wait in the socket's queue.
    """
    if not SUPPORTED:
        return
    folder = Path(tempfile.mkdtemp(prefix="pdrom-"))
    place = folder / "jobs"
    # the server reads one end of a pipe whose other end only this process holds: when this process
    # is gone, the server notices
    owner, _kept_open = os.pipe()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(str(place))
        listener.listen(64)
        numbers = (listener.fileno(), owner)
        subprocess.Popen(
            [python, "-m", "pdrom.pipeline.warm.server", *map(str, numbers), *libraries],
            pass_fds=numbers,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    os.close(owner)
    os.environ[ADDRESS] = str(place)


def stop_server() -> None:
    """Forget the server's address and remove its socket; the server ends with this process."""
    place = os.environ.pop(ADDRESS, None)
    if place is not None:
        with suppress(OSError):
            shutil.rmtree(Path(place).parent)
