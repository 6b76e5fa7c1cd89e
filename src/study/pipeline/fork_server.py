"""Start of jobs as forks of a process in which the libraries are already loaded.

Snakemake executes a script in a thread of the run. This thread starts a process by Python's fork
server (`multiprocessing`) and waits for its end (docs/decisions/0005-fork-server.md).
"""

import fcntl
import multiprocessing
import os
import runpy
import signal
import subprocess
import sys
import time
from multiprocessing import forkserver
from multiprocessing.connection import wait
from threading import Lock
from typing import Any, cast

from snakemake.script import PythonScript

from study.artifact import planned

# On macOS, forks of a process that has loaded system frameworks are unsafe.
METHOD = "forkserver" if sys.platform == "linux" else "spawn"
# `multiprocessing` starts and collects processes in one thread at a time.
_ONE_AT_A_TIME = Lock()
ATTEMPTS = 50


def start_server(preloaded: str = "study.pipeline.preloaded") -> None:
    """Start the fork server, which imports ``preloaded``, and let Snakemake use `run_script`.

    A script in a container is left to Snakemake.
    """
    if METHOD == "forkserver":
        multiprocessing.set_forkserver_preload([preloaded])
        forkserver.ensure_running()
    own = PythonScript.execute_script

    def execute(script: Any, name: str, edit: bool = False) -> None:
        if script.container_img is None:
            run_script(os.path.abspath(name))
        else:
            own(script, name, edit)

    PythonScript.execute_script = execute


def run_script(script: str) -> None:
    """Run the file ``script`` in a fork of the server, or in a new interpreter on macOS.

    Raises CalledProcessError with the exit status, or the negative number of the signal, of a
    script that fails, as `subprocess` does.
    """
    with _ONE_AT_A_TIME:
        job = _started(script)
    wait([job.sentinel])
    with _ONE_AT_A_TIME:
        job.join()
        status = job.exitcode
        job.close()
    if status:
        raise subprocess.CalledProcessError(status, script)


def _started(script: str, attempts: int = ATTEMPTS) -> Any:
    """Start a process that runs ``script``; another server takes the place of one that has died."""
    context = cast(Any, multiprocessing.get_context(METHOD))
    job = context.Process(target=_run_as_main, args=[script])
    try:
        job.start()
    except (EOFError, OSError):  # a server that was just killed is not yet seen as ended
        if attempts == 1:
            raise
        time.sleep(0.1)
        return _started(script, attempts - 1)
    return job


def _run_as_main(script: str) -> None:
    """Run ``script`` as a main program, in a process group that ends with the run."""
    planned.import_planned()
    os.setpgid(0, 0)
    if sys.platform == "linux":
        # the system kills the group when the run closes its end of this pipe, however it ends
        run = cast(int, cast(Any, multiprocessing.parent_process()).sentinel)
        fcntl.fcntl(run, fcntl.F_SETOWN, -os.getpid())
        fcntl.fcntl(run, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(run, fcntl.F_SETFL, os.O_ASYNC)
        if wait([run], timeout=0):  # it has ended before
            os._exit(1)
    sys.argv, sys.path[0] = [script], os.path.dirname(script)
    runpy.run_path(script, run_name="__main__")
