"""Jobs that start from a process in which the libraries are loaded already.

A job's interpreter needs about a second to load NumPy, SciPy, pandas and numba, and a study has
hundreds of jobs. One server process loads them once; each job is a fork of it. The workflow starts
scripts by `client.py`, which asks the server for a fork, hands over its streams, environment and
folder, and ends as the fork ends. Where no server answers (a platform without safe forks, a server
that was killed), the client becomes the plain interpreter itself (`alone.py`).

No job outlives its run, whichever process is killed: the server ends the forks of a client or of a
run that is gone, the system ends those of a server that is gone, the client what they had started,
and a plain interpreter waits for the end of its run.
"""

import os
import secrets
import shlex
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from study.pipeline.fork_server.alone import PIPE
from study.pipeline.fork_server.client import ADDRESS, place_of

# The plain interpreter, in whose place the workflow starts scripts by `interpreter`.
PYTHON = sys.executable

# Forks of a process that has loaded system frameworks are unsafe on macOS.
SUPPORTED = sys.platform == "linux"

# Third-party libraries that most jobs or all figures need, modules that every job begins with, and
# the most frequent experiment.
LIBRARIES = (
    "h5py",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_pdf",
    "numba",
    "numpy",
    "pandas",
    "study.artifact.logs",
    "pdrom.core.provenance",
    "study.experiments.kit.declaration",
    "study.experiments.reruns",
    "pydantic",
    "scipy.linalg",
    "scipy.sparse.linalg",
    "snakemake.iocontainers",
    "snakemake.script",
    "threadpoolctl",
    "yaml",
)


def interpreter() -> str:
    """Words of a shell that run a script by the client, in the place of the plain interpreter."""
    client = Path(__file__).with_name("client.py")
    return f"{shlex.quote(PYTHON)} -I -S {shlex.quote(str(client))}"


def hold_pipe(place: Path) -> None:
    """Open a pipe that closes with this process, which ends the jobs that are no forks.

    Parameters
    ----------
    place : file of the pipe, of which jobs learn by the environment; an older one is replaced

    Raises
    ------
    OSError
        The file system has no such files.
    """
    place.unlink(missing_ok=True)
    os.mkfifo(place)
    reader = os.open(place, os.O_RDONLY | os.O_NONBLOCK)  # a writer needs a reader to begin with
    os.open(place, os.O_WRONLY)
    os.close(reader)
    os.environ[PIPE] = str(place.absolute())


def start_server(libraries: Sequence[str] = LIBRARIES) -> None:
    """Start the server of this process; it ends when this process does.

    The address goes into the environment, which jobs inherit. It is a name that Linux keeps beside
    the file system and forgets with the last process that listens there, so that nothing is left
    of a run that was killed. Clients that come before the ``libraries`` are loaded wait in the
    socket's queue.
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
