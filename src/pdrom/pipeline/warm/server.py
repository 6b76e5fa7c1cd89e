"""The process that jobs are forked from.

It has one thread and loads third-party libraries, and the modules that every job begins with: what
a scene does not list stays unloaded.
It ends, and its jobs with it, when the process that started it is gone.
"""

import atexit
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
from typing import NoReturn

from pdrom.pipeline.warm.client import of_this_user

NUMBER = b"%20d"


class Job:
    """A fork that runs a script, and the client that waits for it."""

    def __init__(self, process: int, client: socket.socket) -> None:
        self.process = process
        self.client = client

    def end(self, status: int) -> None:
        """Tell the client how the job ended; it may be gone."""
        with suppress(OSError):
            self.client.sendall(NUMBER % status)
        self.client.close()

    def kill(self) -> None:
        """Kill the job with everything that it started."""
        with suppress(ProcessLookupError):
            os.killpg(self.process, signal.SIGKILL)


class Server:
    """Forks a job for each request, until its owner is gone.

    Parameters
    ----------
    listener : socket that clients connect to
    owner : read end of a pipe whose other end only the owner holds
    """

    def __init__(self, listener: socket.socket, owner: int) -> None:
        self.listener = listener
        self.owner = owner
        self.jobs: dict[int, Job] = {}
        # a signal wakes the loop up by a byte in this pipe
        self.wake, self._waker = os.pipe()
        os.set_blocking(self._waker, False)

    def serve(self) -> str | None:
        """Path of the script to run, in a fork; None in the server, once its owner is gone."""
        signal.set_wakeup_fd(self._waker, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)
        while True:
            clients = {job.client.fileno(): job for job in self.jobs.values()}
            waiting = [self.listener.fileno(), self.owner, self.wake, *clients]
            ready, _, _ = select.select(waiting, [], [])
            if self.owner in ready:
                for job in self.jobs.values():
                    job.kill()
                return None
            if self.wake in ready:
                os.read(self.wake, 4096)
            self._collect()
            for number in ready:
                # a client sends nothing after its request, so that something to read means that it
                # is gone: its job is ended, too
                if number in clients and clients[number].process in self.jobs:
                    clients[number].kill()
            if self.listener.fileno() in ready and (script := self._accept()):
                return script

    def _collect(self) -> None:
        """Report the jobs that have ended."""
        for process in list(self.jobs):
            done, status = os.waitpid(process, os.WNOHANG)
            if done:
                self.jobs.pop(process).end(status)

    def _accept(self) -> str | None:
        """Fork a job; the path of its script in the fork, None in the server."""
        client, _ = self.listener.accept()
        request = receive(client) if of_this_user(client) else None
        if request is None:
            client.close()
            return None
        parts, streams = request
        process = os.fork()
        # the server and the fork both ask for the group, so that it exists before either goes on
        os.setpgid(process, process)
        if process:
            for stream in streams:
                os.close(stream)
            client.sendall(NUMBER % process)
            self.jobs[process] = Job(process, client)
            return None
        self._become_job(parts, streams, client)
        return parts[1]

    def _become_job(self, parts: list[str], streams: list[int], client: socket.socket) -> None:
        """Leave everything of the server behind and take over the client's surroundings."""
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for job in self.jobs.values():
            job.client.close()
        client.close()
        self.listener.close()
        for number in (self.owner, self.wake, self._waker):
            os.close(number)
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        folder, script, *environment = parts
        os.chdir(folder)
        os.environ.clear()
        for entry in environment:
            key, _, value = entry.partition("=")
            os.environ[key] = value
        sys.argv = [script]
        sys.path[0] = os.path.dirname(script)


def receive(client: socket.socket) -> tuple[list[str], list[int]] | None:
    """Folder, script and environment of a request, and its three streams; None if it was cut."""
    header, streams, _, _ = socket.recv_fds(client, 20, 3)
    content = b""
    size = int(header) if len(header) == 20 else 0
    while len(content) < size and (more := client.recv(size - len(content))):
        content += more
    if not size or len(content) < size:
        for stream in streams:
            os.close(stream)
        return None
    return content.decode("utf-8", "surrogateescape").split("\0"), list(streams)


def main() -> None:
    """Load the libraries, serve; in a fork, run the job's script as a plain interpreter would."""
    listener = socket.socket(fileno=int(sys.argv[1]))
    owner = int(sys.argv[2])
    for library in sys.argv[3:]:
        importlib.import_module(library)
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
