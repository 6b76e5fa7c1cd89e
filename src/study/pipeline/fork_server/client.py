"""Run a script in a fork of the server, or in a plain interpreter where no server answers.

This file is run by its path, before any package is in reach, and for every job: it imports little.
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
    """Exit code of the job; the process dies of the signal that the job died of."""
    name = os.environ.get(ADDRESS)
    script = len(sys.argv) == 2 and not sys.argv[1].startswith("-")
    # a signal that comes before the job is known waits until it is
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
        # the job has ended with the server; what it had started has not
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
    """Connection to the server ``name``; None where nobody of the same user listens."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.connect(place_of(name))
    except OSError:
        return None
    return connection if of_this_user(connection) else None


def place_of(name: str) -> bytes:
    """Address of a socket that is a name only, no file (Linux)."""
    return b"\0" + os.fsencode(name)


def of_this_user(connection: socket.socket) -> bool:
    """Whether the process at the other end of ``connection`` is this user's.

    A name has no permissions of its own.
    """
    reported = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    _process, user, _group = struct.unpack("3i", reported)
    return bool(user == os.geteuid())


def ask(connection: socket.socket) -> bytes:
    """Request a fork over ``connection``; its process number, b"" if the server is gone."""
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
    """Number, a line of twenty characters, from ``connection``; nothing if the server is gone."""
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
    """Hand signal ``number`` on to the process ``job``, which is in a session of its own."""
    with suppress(ProcessLookupError):
        os.killpg(job, number)


if __name__ == "__main__":
    sys.exit(main())
