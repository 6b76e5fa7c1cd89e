"""Start of jobs as forks of a process in which the libraries are already loaded.

Snakemake executes a script in a thread of the run, which requests a fork from the server and waits
for its end. If there is no fork, the script runs in an interpreter of its own. No fork outlives its
run, whichever process is killed (docs/decisions/0005-fork-server.md).
"""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from snakemake.script import PythonScript

from study.artifact import planned

GONE = 69  # exit status of a job that was lost because the server is gone

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


def start_server(libraries: Sequence[str] = LIBRARIES) -> None:
    """Let Snakemake run scripts by `run_script`, in forks of a server that ends with this process.

    Requests that come before the ``libraries`` are loaded wait in the queue of the socket.
    """
    server = None
    if SUPPORTED:
        # only this process has its end of the pair: when it ends, the server sees that and ends
        server, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        subprocess.Popen(
            [sys.executable, "-m", "study.pipeline.fork_server.server", str(other.fileno()),
             *libraries],
            pass_fds=[other.fileno()],
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
        other.close()
    own = PythonScript.execute_script

    def execute(script: Any, name: str, edit: bool = False) -> None:
        if script.container_img is None:
            run_script(server, os.path.abspath(name))
        else:
            own(script, name, edit)

    PythonScript.execute_script = execute


def run_script(server: socket.socket | None, script: str) -> None:
    """Run the file ``script`` in a fork of the ``server``, or in a new interpreter without a fork.

    Raises CalledProcessError with the exit status, or the negative number of the signal, of a
    script that fails, as `subprocess` does.
    """
    job, status = _forked(server, script) if server else (b"", b"")
    if not job:
        subprocess.run([sys.executable, "-m", planned.__name__, script], check=True)
        return
    if not status:
        # the server is gone, and the job with it: end the processes that the job had started
        kill_group(int(job))
    code = os.waitstatus_to_exitcode(int(status)) if status else GONE
    if code:
        raise subprocess.CalledProcessError(code, script)


def _forked(server: socket.socket, script: str) -> tuple[bytes, bytes]:
    """Return process number and wait status of a job; b"" for what the server does not answer."""
    connection, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with connection, suppress(OSError):
        with other:
            socket.send_fds(server, [os.fsencode(script)], [other.fileno()])
        job = connection.recv(20)
        with suppress(OSError):
            return job, connection.recv(20)
        return job, b""
    return b"", b""


def kill_group(job: int) -> None:
    """Kill the process ``job`` and the processes that it has started; it may have ended."""
    with suppress(ProcessLookupError):
        os.killpg(job, signal.SIGKILL)
