"""Jobs that are forked from a server: they behave as scripts of a plain interpreter do."""

import marshal
import os
import shlex
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from study.pipeline import run as running
from study.pipeline.fork_server import SUPPORTED, interpreter
from study.pipeline.fork_server.client import ADDRESS, GONE, of_this_user, place_of

pytestmark = pytest.mark.skipif(not SUPPORTED, reason="no safe forks on this platform")

# A process that starts the server, runs the shell commands of its arguments, and says how they end.
OWNER = """
import subprocess, sys
from study.pipeline.fork_server import start_server
start_server(libraries=["fractions"])
for command in sys.argv[1:]:
    done = subprocess.run(command, shell=True)
    print("ended", done.returncode, flush=True)
"""


def run(*commands: str, owner: str = OWNER, **options) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", owner, *commands],
        capture_output=True, text=True, check=True, **options,
    )  # fmt: skip


def start(command: str, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", OWNER, command], env={**os.environ, **environment},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def script(folder: Path, text: str) -> str:
    """Shell command that runs ``text`` as the workflow runs a script."""
    path = folder / "a script é.py"
    path.write_text(text, encoding="utf-8")
    return f"{interpreter()} '{path}'"


def test_a_job_has_the_surroundings_of_its_client_and_does_not_see_another_job(tmp_path):
    code = """
import os, sys
print(os.getcwd(), os.environ["COLOUR"], sys.argv, sys.stdin.read().strip())
print(__name__, hasattr(sys.modules["fractions"], "mark"))
sys.modules["fractions"].mark = 1
print("a warning", file=sys.stderr)
"""
    command = f"cd / && echo hello | COLOUR=blue {script(tmp_path, code)}"
    done = run(command, command)
    path = str(tmp_path / "a script é.py")
    assert done.stdout.splitlines() == [f"/ blue {[path]} hello", "__main__ False", "ended 0"] * 2
    assert done.stderr == "a warning\n" * 2


def test_a_fork_has_what_numba_registers(tmp_path):
    """What else each process that loads a compiled function would import anew."""
    code = """
import sys
known = set(sys.modules)
from numba.core.registry import cpu_target
cpu_target.typing_context.refresh()
cpu_target.target_context.refresh()
print(sorted(set(sys.modules) - known))
"""
    done = run(script(tmp_path, code), owner=OWNER.replace("fractions", "numba"))
    assert done.stdout.splitlines() == ["[]", "ended 0"]


@pytest.mark.parametrize(
    ("code", "ending", "message"),
    [
        ("import sys; sys.exit(3)", 3, ""),
        ("import sys; sys.exit('pdrom: no')", 1, "pdrom: no\n"),
        ("1 / 0", 1, "ZeroDivisionError: division by zero\n"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", -9, ""),
        ("import os; os._exit(7)", 7, ""),
    ],
)
def test_the_client_ends_as_the_job_does(tmp_path, code, ending, message):
    done = run(f"exec {script(tmp_path, code)}")
    assert done.stdout == f"ended {ending}\n"
    assert done.stderr.endswith(message)


def test_a_signal_reaches_the_job(tmp_path):
    """The client hands it on; the job says when it is ready for it."""
    code = """
import os, signal, sys
signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(5))
print("ready", os.getpid(), os.getppid(), flush=True)
signal.pause()
"""
    command = f"exec {script(tmp_path, code)}"
    owner = start(f"{command} & read line; kill -TERM $!; wait $!")
    assert owner.stdout.readline().startswith("ready")
    out, _ = owner.communicate("go\n")
    assert out == "ended 5\n"


def test_a_job_that_ends_well_leaves_nothing_undone(tmp_path):
    """Though its process does not take itself apart: threads, exit functions, a full buffer."""
    code = f"""
import atexit, sys, threading
begun = threading.Event()
atexit.register(lambda: open({str(tmp_path / "exit")!r}, "w").write("done"))
def work():
    begun.wait()
    open({str(tmp_path / "thread")!r}, "w").write("done")
threading.Thread(target=work).start()
sys.stdout.write("x" * 5000)
begun.set()
"""
    done = run(f"{{ {script(tmp_path, code)}; echo; }}")
    assert done.stdout == f"{'x' * 5000}\nended 0\n"
    assert (tmp_path / "exit").read_text() == (tmp_path / "thread").read_text() == "done"


@pytest.mark.parametrize("victim", ["client", "owner"])
def test_no_job_outlives_its_client_or_the_owner(tmp_path, victim):
    """A pipe that the job holds closes when the job is gone, and only then; no file is left."""
    code = """
import os, signal
print(os.getpid(), flush=True)
signal.pause()
"""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    told = "import os; os.execv('/bin/sh', ['sh', '-c', 'echo $$; exec ' + os.environ['JOB']])"
    surroundings = {"JOB": script(tmp_path, code), "TMPDIR": str(temporary)}
    owner = start(f"exec {shlex.join([sys.executable, '-c', told])}", **surroundings)
    client, _job = int(owner.stdout.readline()), int(owner.stdout.readline())
    os.kill(client if victim == "client" else owner.pid, signal.SIGKILL)
    rest = owner.stdout.read()
    assert rest == ("ended -9\n" if victim == "client" else "")
    owner.communicate()
    assert list(temporary.iterdir()) == []


class ForkServer:
    """A server with clients that misbehave; it has to come to its end without a word."""

    def __init__(self, folder: Path) -> None:
        self.job = folder / "job.py"

    def __enter__(self) -> "ForkServer":
        self.host = start(f"exec 2>&1; echo ${ADDRESS} $$; read nothing")
        address, shell = self.host.stdout.readline().split()
        self.address = place_of(address)
        children = psutil.Process(self.host.pid).children()
        (self.process,) = (child for child in children if child.pid != int(shell))
        return self

    def __exit__(self, *_fault: object) -> None:
        assert self.host.communicate() == ("ended 1\n", None)

    def connect(self) -> socket.socket:
        connection = socket.socket(socket.AF_UNIX)
        connection.connect(self.address)
        return connection

    def ask(self, connection: socket.socket, code: str, stream: int) -> None:
        """Request a job that runs ``code``, with one stream for all three."""
        self.job.write_text(code)
        reader, writer = os.pipe()
        socket.send_fds(connection, [b"x"], [stream, stream, stream, reader])
        os.close(reader)
        with open(writer, "wb") as request:
            marshal.dump(("/", str(self.job), {"A": "b"}), request)

    def serves(self) -> bool:
        """Whether another client gets its job, and the job's end."""
        with self.connect() as connection, open(os.devnull) as nothing:
            self.ask(connection, "import sys; sys.exit(3)", nothing.fileno())
            told = b"".join(iter(lambda: connection.recv(20), b""))
        return os.waitstatus_to_exitcode(int(told[20:])) == 3


def test_no_request_is_dropped_a_silent_client_and_half_a_request_keep_nobody_waiting(tmp_path):
    """The client of none learns it from the end of its connection."""
    reader, writer = os.pipe()
    with ForkServer(tmp_path) as server, server.connect() as silent, server.connect() as half:
        for streams in (0, 1, 3):
            with server.connect() as connection:
                socket.send_fds(connection, [b"x"], [0] * streams)
                assert connection.recv(20) == b""
            assert server.serves()
        socket.send_fds(half, [b"x"], [0, 1, 2, reader])
        os.write(writer, marshal.dumps(("/", "/"))[:4])
        assert server.serves()
        silent.close()
        os.close(writer)
        number, status = half.recv(20), half.recv(20)
        assert int(number) > 0
        assert os.waitstatus_to_exitcode(int(status)) == 1
        assert server.serves()
    os.close(reader)


def test_a_client_that_is_gone_before_its_answer(tmp_path):
    """Its job ends with it: the pipe that the job holds closes, and others get their jobs."""
    reader, writer = os.pipe()
    with ForkServer(tmp_path) as server:
        server.process.suspend()
        with server.connect() as connection:
            server.ask(connection, "import signal; signal.pause()", writer)
        os.close(writer)
        server.process.resume()
        assert os.read(reader, 1) == b""
        assert server.serves()
    os.close(reader)


def test_a_job_ends_with_its_server(tmp_path):
    """Also if its client does nothing about it."""
    reader, writer = os.pipe()
    with ForkServer(tmp_path) as server, server.connect() as connection:
        server.ask(connection, "import os, signal; os.write(1, b'x'); signal.pause()", writer)
        os.close(writer)
        assert os.read(reader, 1) == b"x"
        server.process.kill()
        assert os.read(reader, 1) == b""
    os.close(reader)


def test_what_a_job_has_started_ends_with_the_server(tmp_path):
    """By the client: the pipe that both hold closes."""
    code = """
import os, subprocess
subprocess.run("echo $PPID; read nothing", shell=True)
"""
    owner = start(f"exec {script(tmp_path, code)} 2>&1")
    job = int(owner.stdout.readline())
    os.kill(psutil.Process(job).ppid(), signal.SIGKILL)
    assert owner.stdout.read() == f"ended {GONE}\n"
    owner.communicate()


def test_without_a_server_the_client_is_a_plain_interpreter(tmp_path):
    command = script(tmp_path, "import sys; print('fractions' in sys.modules, sys.argv[1:])")
    for ran, environment, said in (
        (command, {}, "False []\n"),
        (command, {ADDRESS: str(tmp_path / "nobody")}, "False []\n"),
        (f"{interpreter()} -c 'print(1 + 1)'", {}, "2\n"),
    ):
        done = subprocess.run(
            ran, shell=True, capture_output=True, text=True, env={**os.environ, **environment}
        )
        assert done.stdout == said


def test_only_the_same_user_is_answered(monkeypatch):
    ours, theirs = socket.socketpair(socket.AF_UNIX)
    with ours, theirs:
        assert of_this_user(ours)
        monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
        assert not of_this_user(ours)


@pytest.mark.parametrize(
    ("remote", "arguments", "starts"),
    [
        (False, ["--target-jobs", "fom:"], 0),
        (True, ["--executor", "slurm-jobstep", "--target-jobs", "fom:"], 0),
        (True, ["--target-jobs", "fom:"], 1),
    ],
    ids=["here", "hands the batch on", "runs the batch"],
)
def test_a_batch_on_a_node_has_a_server(monkeypatch, remote, arguments, starts):
    started = []
    monkeypatch.setattr(running, "start_server", lambda: started.append(1))
    monkeypatch.setattr(sys, "argv", ["snakemake", *arguments])
    running.start_batch(SimpleNamespace(remote_exec=remote))
    assert len(started) == starts
