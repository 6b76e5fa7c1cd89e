"""Run a script in a fork of the server, or in this interpreter if no server answers.

This file is started for every job, and imports only a few standard modules to start fast.
"""

import marshal
import os
import signal
import socket
import struct
import sys
from contextlib import suppress

ADDRESS = "PDROM_JOB_SERVER"
GONE = 69  # exit status if the server is gone
FORWARDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def main() -> int:
    """Run the job and return its exit code; if a signal ended the job, end by the same signal."""
    name = os.environ.get(ADDRESS)
    script = len(sys.argv) == 2 and not sys.argv[1].startswith("-")
    # signals are forwarded to the job: block them until its process number is known
    signal.pthread_sigmask(signal.SIG_BLOCK, FORWARDED)
    connection = connect(name) if name and script else None
    answer = ask(connection) if connection else b""
    if connection is None or not answer:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, FORWARDED)
        alone = ["-m", "study.artifact.planned"] if script else []
        os.execv(sys.executable, [sys.executable, *alone, *sys.argv[1:]])
    job = int(answer)
    for number in FORWARDED:
        signal.signal(number, lambda received, frame: forward(job, received))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, FORWARDED)
    status = receive(connection)
    if not status:
        # the server is gone, and the job with it: end the processes that the job had started
        forward(job, signal.SIGKILL)
        return GONE
    code = os.waitstatus_to_exitcode(int(status))
    if code < 0:
        if -code in FORWARDED:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    return code


def connect(name: str) -> socket.socket | None:
    """Connect to the server ``name``; return None if no process of this user listens there."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.connect(place_of(name))
    except OSError:
        return None
    return connection if of_this_user(connection) else None


def place_of(name: str) -> bytes:
    """Address of the abstract socket ``name``; such sockets of Linux have no file."""
    return b"\0" + os.fsencode(name)


def of_this_user(connection: socket.socket) -> bool:
    """Return whether the process at the other end of ``connection`` belongs to the current user.

    An abstract socket name has no access permissions, so that any user could listen there.
    """
    reported = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    _process, user, _group = struct.unpack("3i", reported)
    return bool(user == os.geteuid())


def ask(connection: socket.socket) -> bytes:
    """Request a fork over ``connection``; return its process number, or b"" if there is no fork.

    The server gets the standard streams, and a pipe with folder, script and environment of the job.
    """
    environment = {key: value for key, value in os.environ.items() if key != ADDRESS}
    reader, writer = os.pipe()
    try:
        socket.send_fds(connection, [b"\n"], [0, 1, 2, reader])
        os.close(reader)
        with open(writer, "wb") as request:
            marshal.dump((os.getcwd(), os.path.abspath(sys.argv[1]), environment), request)
    except OSError:
        return b""
    return receive(connection)


def receive(connection: socket.socket) -> bytes:
    """Read a number of twenty characters from ``connection``; return b"" if the server is gone."""
    with suppress(OSError):
        return connection.recv(20, socket.MSG_WAITALL)
    return b""


def forward(job: int, number: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(job, number)


if __name__ == "__main__":
    sys.exit(main())
