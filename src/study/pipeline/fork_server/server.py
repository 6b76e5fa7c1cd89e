"""The server process from which jobs are forked.

It has one thread. It loads third-party libraries and the modules that every job imports first; it
does not load modules of effects, which only some scenes list.
It ends, together with its jobs, when the process that started it is gone. A client that is killed,
sends nothing or sends an invalid request is disconnected; other clients are not affected.
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
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

from study.pipeline.fork_server.client import of_this_user

HEADER = 20  # characters of the decimal number that gives the size of the request in bytes
NUMBER = b"%20d"
LARGEST = 1 << 24  # largest size of a request in bytes; environments are smaller on all systems
# Seconds within which a client must send its request after it has connected.
PATIENCE = 30.0
_DIES_WITH_PARENT = 1  # constant PR_SET_PDEATHSIG of <sys/prctl.h>


class Request:
    """A client's request, as far as received: folder, script, environment, three standard streams.

    Parameters
    ----------
    client : socket of the client, set to non-blocking
    until : deadline of the request, seconds of the monotonic clock
    """

    def __init__(self, client: socket.socket, until: float) -> None:
        client.setblocking(False)
        self.client = client
        self.until = until
        self.streams: list[int] = []
        self._content = b""

    def read(self) -> list[str]:
        """Return folder, script and environment once the request is complete, else an empty list.

        Raises
        ------
        OSError, ValueError
            The client is gone, or its data are not a valid request.
        """
        more, streams, _, _ = socket.recv_fds(self.client, 1 << 16, 3)
        self.streams += streams
        self._content += more
        if not more:
            raise OSError("the client is gone")
        if len(self._content) < HEADER:
            return []
        size = int(self._content[:HEADER])
        if not 0 < size <= LARGEST:
            raise ValueError(f"a request of {size} bytes")
        if len(self._content) < HEADER + size:
            return []
        found = self._content[HEADER:].decode("utf-8", "surrogateescape").split("\0")
        if len(found) < 2 or len(self.streams) != 3:
            raise ValueError("no folder, script or streams")
        return found

    def close_streams(self) -> None:
        """Close the server's copies of the client's standard streams."""
        for stream in self.streams:
            os.close(stream)


def kill(process: int) -> None:
    """Kill the process group of a job, which includes the processes that the job started."""
    with suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)


class Server:
    """Server that forks a job for each request until its owner, the process of the run, is gone.

    Parameters
    ----------
    listener : socket to which clients connect
    owner : read end of a pipe whose write end only the owner has open
    patience : seconds within which a client must send its request
    """

    def __init__(self, listener: socket.socket, owner: int, patience: float = PATIENCE) -> None:
        self.listener = listener
        self.owner = owner
        self.patience = patience
        self.requests: list[Request] = []
        # clients that wait for the end of their job, by the process number of the job
        self.jobs: dict[int, socket.socket] = {}
        # a signal writes a byte into this pipe, which ends the wait of the loop
        self.wake, self._waker = os.pipe()
        os.set_blocking(self._waker, False)
        self._process = os.getpid()
        self._libc = ctypes.CDLL(None)

    def serve(self) -> str | None:
        """Serve requests; return the script in a fork, None in the server when its owner ends."""
        signal.set_wakeup_fd(self._waker, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)
        while True:
            ready = self._wait()
            if self.owner in ready:
                for process in self.jobs:
                    kill(process)
                return None
            if self.wake in ready:
                os.read(self.wake, 4096)
            self._collect()
            for process, client in self.jobs.items():
                # a client sends nothing after its request: readable data mean that its connection
                # is closed, so that its job is killed
                if client.fileno() in ready:
                    kill(process)
            for request in [r for r in self.requests if r.client.fileno() in ready]:
                if script := self._answer(request):
                    return script
            for request in [r for r in self.requests if r.until <= time.monotonic()]:
                self._drop(request)
            if self.listener.fileno() in ready:
                self._accept()

    def _clients(self) -> list[socket.socket]:
        """Sockets of all clients, both of running jobs and of incomplete requests."""
        return [*self.jobs.values(), *(request.client for request in self.requests)]

    def _wait(self) -> set[int]:
        """Wait for input; return readable descriptors, none when a request's deadline passes."""
        clients = [client.fileno() for client in self._clients()]
        waiting = [self.listener.fileno(), self.owner, self.wake, *clients]
        until = min((request.until for request in self.requests), default=None)
        limit = None if until is None else max(until - time.monotonic(), 0.0)
        return set(select.select(waiting, [], [], limit)[0])

    def _collect(self) -> None:
        """Send the exit statuses of ended jobs to their clients; ignore clients that are gone."""
        for process in list(self.jobs):
            done, status = os.waitpid(process, os.WNOHANG)
            if done:
                with self.jobs.pop(process) as client, suppress(OSError):
                    client.sendall(NUMBER % status)

    def _accept(self) -> None:
        """Accept a new connection, and close it if it is from another user."""
        client, _ = self.listener.accept()
        if of_this_user(client):
            self.requests.append(Request(client, time.monotonic() + self.patience))
        else:
            client.close()

    def _drop(self, request: Request) -> None:
        """Close the connection to a client, which then runs its job in a plain interpreter."""
        self.requests.remove(request)
        request.close_streams()
        request.client.close()

    def _answer(self, request: Request) -> str | None:
        """Fork a job if its request is complete; return the script in the fork, else None."""
        try:
            parts = request.read()
            if not parts:
                return None
            process = os.fork()
        except (OSError, ValueError):
            self._drop(request)
            return None
        if not process:
            self._become_job(parts, request)
            return parts[1]
        # server and fork both set the process group, so that it exists before either continues
        os.setpgid(process, process)
        self.requests.remove(request)
        request.close_streams()
        self.jobs[process] = request.client
        try:
            request.client.sendall(NUMBER % process)
        except OSError:
            kill(process)
        return None

    def _become_job(self, parts: list[str], request: Request) -> None:
        """Turn a fork into the job: close the server's descriptors, set up the job's streams."""
        os.setpgid(0, 0)
        # ask to be killed when the server ends; the server may already have ended before this call
        self._libc.prctl(_DIES_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != self._process:
            os._exit(1)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for number, stream in enumerate(request.streams):
            os.dup2(stream, number)
        for other in self.requests:
            other.close_streams()
        for client in self._clients():
            client.close()
        self.listener.close()
        for number in (self.owner, self.wake, self._waker):
            os.close(number)
        folder, script, *environment = parts
        os.chdir(folder)
        os.environ.clear()
        for entry in environment:
            key, _, value = entry.partition("=")
            os.environ[key] = value
        sys.argv = [script]
        sys.path[0] = os.path.dirname(script)


def load(libraries: Sequence[str]) -> None:
    """Import ``libraries``; register numba's own functions once, which each fork would repeat."""
    for library in libraries:
        importlib.import_module(library)
    if "numba" in libraries:
        target = importlib.import_module("numba.core.registry").cpu_target
        target.typing_context.refresh()
        target.target_context.refresh()


def main() -> None:
    """Load the libraries and serve; in a fork, run the job's script as an interpreter would."""
    listener = socket.socket(fileno=int(sys.argv[1]))
    owner = int(sys.argv[2])
    load(sys.argv[3:])
    gc.collect()
    gc.freeze()
    script = Server(listener, owner).serve()
    if script is not None:
        run(script)


def run(script: str) -> NoReturn:
    """Run a script as the main module; an exception ends the process as in a plain interpreter.

    After a successful script the process exits by ``os._exit``, as in `multiprocessing`: to free
    the memory of the libraries would take longer than the fork.
    """
    runpy.run_path(script, run_name="__main__")
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
