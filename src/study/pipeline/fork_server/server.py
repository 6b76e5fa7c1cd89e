"""The process that jobs are forked from.

It has one thread and loads third-party libraries, and the modules that every job begins with: what
a scene does not list stays unloaded.
It ends, and its jobs with it, when the process that started it is gone. A client that is killed,
says nothing or asks for what is no request is dropped, and costs the others nothing.
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

HEADER = 20  # characters of the line that says how many bytes follow
NUMBER = b"%20d"
LARGEST = 1 << 24  # bytes of a request; systems allow environments less
# Seconds that a client may take for its request, which it sends as soon as it is connected.
PATIENCE = 30.0
_DIES_WITH_PARENT = 1  # PR_SET_PDEATHSIG of <sys/prctl.h>


class Request:
    """Request of a client as received so far: folder, script, environment, and three streams.

    Parameters
    ----------
    client : connection, which is not waited for
    until : when its patience ends, seconds of the monotonic clock
    """

    def __init__(self, client: socket.socket, until: float) -> None:
        client.setblocking(False)
        self.client = client
        self.until = until
        self.streams: list[int] = []
        self._content = b""

    def read(self) -> list[str]:
        """Folder, script and environment, once there is all of it to read; nothing before.

        Raises
        ------
        OSError, ValueError
            The client is gone, or this is no request.
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
        """Close the server's copies of the streams."""
        for stream in self.streams:
            os.close(stream)


def kill(process: int) -> None:
    """Kill a job with everything that it started."""
    with suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)


class Server:
    """Forks a job for each request, until its owner is gone.

    Parameters
    ----------
    listener : socket that clients connect to
    owner : read end of a pipe whose other end only the owner holds
    patience : seconds that a client may take for its request
    """

    def __init__(self, listener: socket.socket, owner: int, patience: float = PATIENCE) -> None:
        self.listener = listener
        self.owner = owner
        self.patience = patience
        self.requests: list[Request] = []
        # the client that waits for a fork, by the number of that process
        self.jobs: dict[int, socket.socket] = {}
        # a signal wakes the loop up by a byte in this pipe
        self.wake, self._waker = os.pipe()
        os.set_blocking(self._waker, False)
        self._process = os.getpid()
        self._libc = ctypes.CDLL(None)

    def serve(self) -> str | None:
        """Path of the script to run, in a fork; None in the server, once its owner is gone."""
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
                # a client sends nothing after its request, so that something to read means that it
                # is gone: its job is ended, too
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
        """Sockets of clients: those of running jobs and of incomplete requests."""
        return [*self.jobs.values(), *(request.client for request in self.requests)]

    def _wait(self) -> set[int]:
        """Descriptors with something to read, or none when a client's patience ends."""
        clients = [client.fileno() for client in self._clients()]
        waiting = [self.listener.fileno(), self.owner, self.wake, *clients]
        until = min((request.until for request in self.requests), default=None)
        limit = None if until is None else max(until - time.monotonic(), 0.0)
        return set(select.select(waiting, [], [], limit)[0])

    def _collect(self) -> None:
        """Tell the clients of the jobs that have ended their exit status; a client may be gone."""
        for process in list(self.jobs):
            done, status = os.waitpid(process, os.WNOHANG)
            if done:
                with self.jobs.pop(process) as client, suppress(OSError):
                    client.sendall(NUMBER % status)

    def _accept(self) -> None:
        """Begin to listen to a client."""
        client, _ = self.listener.accept()
        if of_this_user(client):
            self.requests.append(Request(client, time.monotonic() + self.patience))
        else:
            client.close()

    def _drop(self, request: Request) -> None:
        """Close the connection to a client, which then runs its job itself."""
        self.requests.remove(request)
        request.close_streams()
        request.client.close()

    def _answer(self, request: Request) -> str | None:
        """Fork a job once its request is complete; the script in the fork, None in the server."""
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
        # the server and the fork both ask for the group, so that it exists before either goes on
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
        """Leave everything of the server behind and take over the client's surroundings."""
        os.setpgid(0, 0)
        # end with the server, however that ends; it may have ended just before
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
    """Import ``libraries``; with numba, register its own functions, which each fork would do."""
    for library in libraries:
        importlib.import_module(library)
    if "numba" in libraries:
        target = importlib.import_module("numba.core.registry").cpu_target
        target.typing_context.refresh()
        target.target_context.refresh()


def main() -> None:
    """Load the libraries, serve; in a fork, run the job's script as a plain interpreter would."""
    listener = socket.socket(fileno=int(sys.argv[1]))
    owner = int(sys.argv[2])
    load(sys.argv[3:])
    gc.collect()
    gc.freeze()
    script = Server(listener, owner).serve()
    if script is not None:
        run(script)


def run(script: str) -> NoReturn:
    """Run a script as the main module; its exceptions end the process in the usual way.

    After a script that ends well the process is left at once, as `multiprocessing` leaves its
    forks: to take the libraries apart in memory takes longer than to fork them.
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
