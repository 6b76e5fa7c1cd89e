"""Run a script in a fork of the server, or in a plain interpreter where no server answers.

This file is started by its path, for every job: it imports a few standard modules only.
"""

import os
import signal
import socket
import struct
import sys
from contextlib import suppress

ADDRESS = "PDROM_JOB_SERVER"
FORWARDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def main() -> int:
    """Return the exit code of the job; a job that died of a signal ends this process by it, too."""
    name = os.environ.get(ADDRESS)
    script = len(sys.argv) == 2 and not sys.argv[1].startswith("-")
    # signals are blocked until the job's process number is known, so that they can be forwarded
    signal.pthread_sigmask(signal.SIG_BLOCK, FORWARDED)
    connection = connect(name) if name and script else None
    answer = ask(connection) if connection else b""
    if connection is None or not answer:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, FORWARDED)
        alone = [os.path.join(os.path.dirname(__file__), "alone.py")] if script else []
        os.execv(sys.executable, [sys.executable, *alone, *sys.argv[1:]])
    job = int(answer)
    for number in FORWARDED:
        signal.signal(number, lambda received, frame: forward(job, received))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, FORWARDED)
    status = receive(connection)
    if not status:
        # the job has ended with the server, but processes that the job had started still run
        forward(job, signal.SIGKILL)
        sys.stderr.write("pdrom: the process that jobs start from is gone\n")
        return 1
    code = os.waitstatus_to_exitcode(int(status))
    if code < 0:
        if -code in FORWARDED:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    return code


def connect(name: str) -> socket.socket | None:
    """Connection to the server ``name``; None if no process of the same user listens there."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.connect(place_of(name))
    except OSError:
        return None
    return connection if of_this_user(connection) else None


def place_of(name: str) -> bytes:
    """Address of an abstract socket (Linux), which is a name and has no file."""
    return b"\0" + os.fsencode(name)


def of_this_user(connection: socket.socket) -> bool:
    """Return whether the process at the other end of ``connection`` belongs to the current user.

    An abstract socket name has no access permissions, so that any user could listen there.
    """
    reported = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    _process, user, _group = struct.unpack("3i", reported)
    return bool(user == os.geteuid())


def ask(connection: socket.socket) -> bytes:
    """Request a fork over ``connection``; return its process number, b"" if the server is gone."""
    environment = [f"{key}={value}" for key, value in os.environ.items() if key != ADDRESS]
    parts = [os.getcwd(), os.path.abspath(sys.argv[1]), *environment]
    request = "\0".join(parts).encode("utf-8", "surrogateescape")
    try:
        socket.send_fds(connection, [b"%20d" % len(request)], [0, 1, 2])
        connection.sendall(request)
    except OSError:
        return b""
    return receive(connection)


def receive(connection: socket.socket) -> bytes:
    """Read a number of twenty characters from ``connection``; return b"" if the server is gone."""
    text = b""
    while len(text) < 20:
        try:
            more = connection.recv(20 - len(text))
        except OSError:
            more = b""
        if not more:
            return b""
        text += more
    return text


def forward(job: int, number: int) -> None:
    """Send signal ``number`` to the process group ``job``, which has a session of its own."""
    with suppress(ProcessLookupError):
        os.killpg(job, number)


if __name__ == "__main__":
    sys.exit(main())
