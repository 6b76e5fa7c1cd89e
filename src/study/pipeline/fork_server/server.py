"""Server process from which jobs are forked.

It has one thread, and ends, together with its jobs, when the process that started it has ended.
"""

import atexit
import ctypes
import gc
import importlib
import os
import runpy
import select
import signal
import socket
import sys
import threading
from contextlib import suppress
from typing import Any

from study.artifact.planned import import_planned
from study.pipeline.fork_server import kill_group

_DIES_WITH_PARENT = 1  # constant PR_SET_PDEATHSIG of <sys/prctl.h>


class Server:
    """Server that forks a job for each request until its owner, the process of the run, ends.

    A request is the path of a script, with a socket on which the server answers: the process number
    of the job, then its wait status.

    owner : socket from which the requests are read; its other end is open in the owner only
    """

    def __init__(self, owner: socket.socket) -> None:
        self.owner = owner
        # process number of a job -> socket on which its end is reported
        self.jobs: dict[int, socket.socket] = {}
        # the signal SIGCHLD at a job's end writes a byte into this pipe, which wakes the loop
        self.wake, self._waker = os.pipe()
        os.set_blocking(self._waker, False)
        self._process = os.getpid()
        self._libc = ctypes.CDLL(None)

    def serve(self) -> str | None:
        """Fork a job per request; return None when the owner ends, in a fork its script's path."""
        signal.set_wakeup_fd(self._waker, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)
        watched: list[Any] = [self.owner, self.wake]
        while True:
            ready = select.select(watched, [], [])[0]
            if self.wake in ready:
                os.read(self.wake, 4096)
            for process in list(self.jobs):
                done, status = os.waitpid(process, os.WNOHANG)
                if done:
                    _answer(self.jobs.pop(process), status, last=True)
            if self.owner in ready:
                script, sockets, _, _ = socket.recv_fds(self.owner, 1 << 16, 1)
                if not script:
                    for process in self.jobs:
                        kill_group(process)
                    return None
                if self._fork(socket.socket(fileno=sockets[0])):
                    return os.fsdecode(script)

    def _fork(self, client: socket.socket) -> bool:
        """Fork a job that reports to ``client``; return True in the fork, False in the server.

        Without a fork, the connection is closed without an answer.
        """
        try:
            process = os.fork()
        except OSError:
            client.close()
            return False
        if process == 0:
            self._become_job(client)
            return True
        # server and fork both do this, so that the process group exists before either continues
        os.setpgid(process, process)
        self.jobs[process] = client
        _answer(client, process)
        return False

    def _become_job(self, client: socket.socket) -> None:
        """Prepare this fork for its job, and close the server's files."""
        os.setpgid(0, 0)
        # let the system kill this job when the server ends; exit if the server has ended already
        self._libc.prctl(_DIES_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != self._process:
            os._exit(1)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for other in (self.owner, client, *self.jobs.values()):
            other.close()
        os.close(self.wake)
        os.close(self._waker)


def _answer(client: socket.socket, number: int, last: bool = False) -> None:
    """Send ``number`` to ``client``, whose owner may have ended; close it after the ``last``."""
    with suppress(OSError):
        client.send(str(number).encode())
    if last:
        client.close()


def main() -> None:
    """Load the libraries and serve requests; in a fork, run the script of the job."""
    owner, libraries = socket.socket(fileno=int(sys.argv[1])), sys.argv[2:]
    import_planned()
    for library in libraries:
        importlib.import_module(library)
    if "numba" in libraries:
        # register numba's own functions once, which otherwise every fork would do
        target = importlib.import_module("numba.core.registry").cpu_target
        target.typing_context.refresh()
        target.target_context.refresh()
    gc.collect()
    gc.freeze()
    script = Server(owner).serve()
    if script is None:
        return
    sys.argv, sys.path[0] = [script], os.path.dirname(script)
    # an exception ends the process as in a plain interpreter
    runpy.run_path(script, run_name="__main__")
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    # do not free the memory of the libraries, which takes long (`multiprocessing` does so, too)
    os._exit(0)


if __name__ == "__main__":
    main()
