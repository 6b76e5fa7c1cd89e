"""Only one run works in a folder; it ends at once and completely."""

import os
import signal
import subprocess
import sys

import pytest

from pdrom.core.errors import PdromError
from study.pipeline import running
from study.pipeline.signals import ENDINGS, KEPT

HOLDER = """
import sys, time
from study.pipeline.running import hold
hold()
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def other():
    """Another process that holds the lock."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def snakemake_lock() -> None:
    running.SNAKEMAKE_LOCKS.mkdir(parents=True)
    (running.SNAKEMAKE_LOCKS / "0.output.lock").write_text("results/x\n")


def test_a_second_run_names_the_first_and_locks_end_with_their_process(other):
    snakemake_lock()
    with pytest.raises(PdromError, match=rf"process {other.pid} on .* uses this folder"):
        running.hold()
    assert running.LOCK.read_text().startswith(f"process {other.pid} ")
    assert running.SNAKEMAKE_LOCKS.exists()
    other.kill()
    other.wait()
    descriptor = running.hold()
    assert running.LOCK.read_text().startswith(f"process {os.getpid()} ")
    assert not running.SNAKEMAKE_LOCKS.exists()
    os.close(descriptor)


def test_a_lock_is_not_inherited_by_jobs():
    descriptor = running.hold()
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as job:
        os.close(descriptor)
        os.close(running.hold())
        job.communicate(b"\n")


LEAVES = """
import os
from study.pipeline.signals import *
handle(leave)
os.write(1, b'ready\\n')
"""


@pytest.mark.parametrize("number", ENDINGS)
@pytest.mark.parametrize("ignores", [False, True])
def test_a_signal_ends_a_run_with_one_line(number, ignores):
    """Even if sys.stderr is redirected; signals that nohup ignores stay ignored."""
    code = "import sys\nsys.stderr = None\n" + LEAVES + "sys.stdin.read()"
    if ignores:
        code = f"import signal\nsignal.signal({number:d}, signal.SIG_IGN)\n{LEAVES}"
    line = "" if ignores else f"pdrom: {ENDINGS[number]}; {KEPT}\n"
    assert signalled(number, code) == (0 if ignores else 128 + number, "", line)


def signalled(number: int, *command: str) -> tuple[int, str, str]:
    """Exit status, output and errors of a program that gets a signal when it is ready."""
    process = subprocess.Popen(
        [sys.executable, "-c", *command],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # nohup may start the tests
    )  # fmt: skip
    assert process.stdout.readline() == "ready\n"
    process.send_signal(number)
    out, errors = process.communicate()
    return process.returncode, out, errors
