"""Start of jobs as forks of a process in which the libraries are already loaded.

A job's interpreter needs about a second to load NumPy, SciPy, pandas and numba, and a study has
hundreds of jobs. One server process loads them once; each job is a fork of it. The workflow starts
scripts by `client.py`, which asks the server for a fork, hands over its streams, environment and
folder, and ends as the fork ends. Where no server answers (a platform without safe forks, a server
that was killed), the client becomes the plain interpreter itself.

No job outlives its run, whichever process is killed. The server ends the forks of a killed client
or run, the operating system ends the forks of a killed server, the client ends the processes that
those forks had started, and a plain interpreter ends itself when its run ends.
"""

import os
import secrets
import shlex
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from study.pipeline.fork_server.client import ADDRESS, PIPE, place_of

# Path of the Python interpreter; the workflow uses the command of `interpreter` in its place.
PYTHON = sys.executable

# Forks of a process that has loaded system frameworks are unsafe on macOS.
SUPPORTED = sys.platform == "linux"

# Modules that the server loads in advance: third-party libraries of most jobs or of all figures,
# modules that every job imports first, and the most frequent experiment.
LIBRARIES = (
    "h5py", "matplotlib.backends.backend_agg", "matplotlib.backends.backend_pdf", "numba", "numpy",
    "pandas", "study.artifact.logs", "pdrom.core.provenance", "study.experiments.kit.base",
    "study.experiments.reruns", "pydantic", "scipy.linalg", "scipy.sparse.linalg",
    "snakemake.iocontainers", "snakemake.script", "threadpoolctl", "yaml",
)  # fmt: skip


def interpreter() -> str:
    """Shell command that runs a script by the client, used in place of the plain interpreter."""
    client = Path(__file__).with_name("client.py")
    return f"{shlex.quote(PYTHON)} -I -S {shlex.quote(str(client))}"


def hold_pipe(place: Path) -> None:
    """Open a named pipe that closes with this process, so that jobs that are no forks end with it.

    Parameters
    ----------
    place : path of the pipe, passed to jobs by an environment variable; an old file is replaced

    Raises
    ------
    OSError
        The file system does not support named pipes.
    """
    place.unlink(missing_ok=True)
    os.mkfifo(place)
    reader = os.open(place, os.O_RDONLY | os.O_NONBLOCK)  # a FIFO must have a reader to be opened
    os.open(place, os.O_WRONLY)
    os.close(reader)
    os.environ[PIPE] = str(place.absolute())


def start_server(libraries: Sequence[str] = LIBRARIES) -> None:
    """Start the fork server of this process; the server ends when this process does.

    The address goes into an environment variable, which jobs inherit. It is an abstract socket name
    of Linux, which is no file and disappears with the last process that listens there, so that
    nothing is left of a killed run. Clients that connect before the ``libraries`` are loaded wait
    in the socket's queue.
    """
    if not SUPPORTED:
        return
    name = f"pdrom-{secrets.token_hex(16)}"
    # the server reads one end of a pipe whose other end only this process holds: when this process
    # is gone, the server notices
    owner, _kept_open = os.pipe()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(place_of(name))
        listener.listen(64)
        numbers = (listener.fileno(), owner)
        subprocess.Popen(
            [PYTHON, "-m", "study.pipeline.fork_server.server", *map(str, numbers), *libraries],
            pass_fds=numbers,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    os.close(owner)
    os.environ[ADDRESS] = name
