"""Start of jobs as forks of a process in which the libraries are already loaded.

The workflow starts scripts by `client.py`, which requests a fork from the server, passes on its
streams, environment and folder, and exits with the status of the fork. If no server answers, the
client runs the script in its own interpreter. No fork outlives its run, whichever process is killed
(docs/decisions/0005-fork-server.md).
"""

import os
import secrets
import shlex
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from study.pipeline.fork_server.client import ADDRESS, place_of

# Path of Python's interpreter. The workflow starts scripts by the command from `interpreter`.
PYTHON = sys.executable

# On macOS, forks of a process that has loaded system frameworks are unsafe.
SUPPORTED = sys.platform == "linux"

# Modules that the server loads: libraries that most jobs or all figures use, modules that every
# job imports first, and the modules of the experiment with the most jobs.
LIBRARIES = (
    "h5py", "matplotlib.backends.backend_agg", "matplotlib.backends.backend_pdf", "numba", "numpy",
    "pandas", "study.artifact.logs", "pdrom.core.provenance", "study.experiments.kit.base",
    "study.experiments.reruns", "pydantic", "scipy.linalg", "scipy.sparse.linalg",
    "snakemake.iocontainers", "snakemake.script", "threadpoolctl", "yaml",
)  # fmt: skip


def interpreter() -> str:
    """Shell command that runs a script in a fork of the server (by means of `client.py`)."""
    client = Path(__file__).with_name("client.py")
    return f"{shlex.quote(PYTHON)} -I -S {shlex.quote(str(client))}"


def start_server(libraries: Sequence[str] = LIBRARIES) -> None:
    """Start the fork server of this process; the server ends when this process ends.

    Jobs inherit the server's address, an abstract socket name of Linux, in an environment variable.
    Clients that connect before the ``libraries`` are loaded wait in the queue of the socket.
    """
    if not SUPPORTED:
        return
    name = f"pdrom-{secrets.token_hex(16)}"
    # only this process has the write end of this pipe: when it ends, the server sees that and ends
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
