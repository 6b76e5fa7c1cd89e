"""Start jobs as forks of a process in which the libraries are already loaded.

Snakemake executes a script in a thread of the run. This thread lets Python's fork server
(`multiprocessing`) start a process, and waits for its end (docs/decisions/0005-fork-server.md).
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
# `multiprocessing` may start and collect processes only in one thread at a time.
_ONE_AT_A_TIME = Lock()
ATTEMPTS = 50


def start_server(preloaded: str = "study.pipeline.preloaded") -> None:
    """Start the fork server, which imports ``preloaded``, and let Snakemake use `run_script`.

    Snakemake itself runs scripts that have a container.
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

    If the script fails, raises CalledProcessError with its exit status, or the negative number of
    the signal that ended it, as `subprocess` does.
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
    """Start a process that runs ``script``; if the fork server has died, start another server."""
    context = cast(Any, multiprocessing.get_context(METHOD))
    job = context.Process(target=_run_as_main, args=[script])
    try:
        job.start()
    except (EOFError, OSError):  # the system may report a server that was killed only later
        if attempts == 1:
            raise
        time.sleep(0.1)
        return _started(script, attempts - 1)
    return job


def _run_as_main(script: str) -> None:
    """Run ``script`` as a main program, in a process group that ends when the run ends."""
    planned.import_planned()
    os.setpgid(0, 0)
    if sys.platform == "linux":
        # the system kills the group when the run closes its end of this pipe, even if it is killed
        run = cast(int, cast(Any, multiprocessing.parent_process()).sentinel)
        fcntl.fcntl(run, fcntl.F_SETOWN, -os.getpid())
        fcntl.fcntl(run, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(run, fcntl.F_SETFL, os.O_ASYNC)
        if wait([run], timeout=0):  # the run has ended before this process asked for the signal
            os._exit(1)
    sys.argv, sys.path[0] = [script], os.path.dirname(script)
    runpy.run_path(script, run_name="__main__")
