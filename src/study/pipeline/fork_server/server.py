"""Server process from which jobs are forked.

It has one thread, and ends, together with its jobs, when the process that started it has ended.
"""

import atexit
import ctypes
import gc
import importlib
import marshal
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
from study.pipeline.fork_server.client import forward, of_this_user

NUMBER = b"%20d"
_DIES_WITH_PARENT = 1  # constant PR_SET_PDEATHSIG of <sys/prctl.h>


class Server:
    """Server that forks a job for each request until its owner, the process of the run, ends.

    A request is a message with file descriptors of the three standard streams and of a pipe. From
    the pipe, the fork reads the folder, the script and the variables of the environment.

    listener : socket to which clients connect
    owner : read end of a pipe whose write end only the owner has open
    """

    def __init__(self, listener: socket.socket, owner: int) -> None:
        self.listener = listener
        self.owner = owner
        # clients that have sent no request yet
        self.silent: list[socket.socket] = []
        # process number of a job -> client that waits for the job's end
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
        while True:
            waiting: list[Any] = [self.listener, self.owner, self.wake]
            ready = select.select([*waiting, *self.silent, *self.jobs.values()], [], [])[0]
            if self.owner in ready:
                for process in self.jobs:
                    forward(process, signal.SIGKILL)
                return None
            if self.wake in ready:
                os.read(self.wake, 4096)
            # send the exit status of each ended job to its client, which may have ended as well
            for process in list(self.jobs):
                done, status = os.waitpid(process, os.WNOHANG)
                if done:
                    with self.jobs.pop(process) as client, suppress(OSError):
                        client.sendall(NUMBER % status)
            for process, client in self.jobs.items():
                # a client sends nothing after its request: a readable connection means it is gone
                if client in ready:
                    forward(process, signal.SIGKILL)
            for client in [client for client in self.silent if client in ready]:
                if script := self._answer(client):
                    return script
            if self.listener in ready:
                client, _ = self.listener.accept()
                if of_this_user(client):
                    self.silent.append(client)
                else:
                    client.close()

    def _answer(self, client: socket.socket) -> str | None:
        """Fork a job if the client's message is a request, else close the connection.

        Return the path of the script in the fork, None in the server. A client whose connection
        was closed runs its script without the server.
        """
        self.silent.remove(client)
        streams: list[int] = []
        process = None
        with suppress(OSError):
            streams = socket.recv_fds(client, 1, 4)[1]
            process = os.fork() if len(streams) == 4 else None
        if process == 0:
            return self._become_job(client, streams)
        for stream in streams:
            os.close(stream)
        if process is None:
            client.close()
            return None
        # server and fork both do this, so that the process group exists before either continues
        os.setpgid(process, process)
        self.jobs[process] = client
        try:
            client.sendall(NUMBER % process)
        except OSError:
            forward(process, signal.SIGKILL)
        return None

    def _become_job(self, client: socket.socket, streams: list[int]) -> str:
        """Prepare this fork for its job, close the server's files; return the script's path."""
        os.setpgid(0, 0)
        # let the system kill this job when the server ends; exit if the server has ended already
        self._libc.prctl(_DIES_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != self._process:
            os._exit(1)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for other in (self.listener, client, *self.silent, *self.jobs.values()):
            other.close()
        for number, stream in enumerate(streams[:3]):
            os.dup2(stream, number)
        for descriptor in (self.owner, self.wake, self._waker, *streams[:3]):
            os.close(descriptor)
        try:
            with open(streams[3], "rb") as request:
                folder, script, environment = marshal.load(request)
        except (EOFError, ValueError, TypeError):  # the client was killed while it wrote
            os._exit(1)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        sys.argv = [script]
        sys.path[0] = os.path.dirname(script)
        return script


def main() -> None:
    """Load the libraries and serve requests; in a fork, run the script of the job."""
    listener = socket.socket(fileno=int(sys.argv[1]))
    owner, libraries = int(sys.argv[2]), sys.argv[3:]
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
    script = Server(listener, owner).serve()
    if script is None:
        return
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
