"""A run is alone in its folder; it ends at once, and wholly."""

import os
import signal
import subprocess
import sys

import pytest

from study.pipeline import running

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


def test_the_second_process_names_the_first_whose_locks_go_with_it(other):
    snakemake_lock()
    with pytest.raises(running.AtWorkError, match=rf"process {other.pid} on .* is at work"):
        running.hold()
    assert running.LOCK.read_text().startswith(f"process {other.pid} ")
    running.remove_stale_locks()
    assert running.SNAKEMAKE_LOCKS.exists()
    other.kill()
    other.wait()
    running.remove_stale_locks()
    assert not running.SNAKEMAKE_LOCKS.exists()
    snakemake_lock()
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


def test_a_folder_that_cannot_be_written_is_named(folder):
    (folder / ".snakemake").write_text("a file where the folder should be")
    with pytest.raises(running.AtWorkError, match=r"run\.lock: cannot be written"):
        running.hold()


# A run with a job in a shell, as Snakemake waits for it; it prints how the job ended.
RUNS = """
import os, subprocess, sys
from study.pipeline import running
running.PATIENCE = float(sys.argv[1])
running.stop_at_sigterm(lambda: os.write(1, b"noted\\n"))
job = subprocess.Popen(["sh", "-c", sys.argv[2]], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
ready = job.stdout.readline()
try:
    os.write(1, ready)
    job.wait()
except KeyboardInterrupt:
    print(job.wait(), flush=True)
"""


def sigterm(*command: str, reads: bool = True) -> tuple[int, str, str]:
    """Exit status, output and errors, if one reads them, of a program that gets SIGTERM."""
    process = subprocess.Popen(
        [sys.executable, "-c", *command],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "ready\n"
    if not reads:
        process.stderr.close()
        process.stderr = None
    process.send_signal(signal.SIGTERM)
    out, errors = process.communicate()
    return process.returncode, out, errors


@pytest.mark.parametrize(
    ("patience", "job", "ending"),
    [
        ("1e6", "echo ready; read nothing", -signal.SIGTERM),
        ("0", "trap '' TERM; echo ready; read nothing", -signal.SIGKILL),
    ],
    ids=["ends by it", "does not listen"],
)
def test_a_run_ends_its_jobs(patience, job, ending):
    said = "pdrom: SIGTERM: ending the jobs that run\n"
    assert sigterm(RUNS, patience, job) == (0, f"noted\n{ending:d}\n", said)


def test_a_run_whose_reader_is_gone_ends_its_job_too():
    ended = sigterm(RUNS, "1e6", "echo ready; read nothing", reads=False)
    assert ended[1] == f"noted\n{-signal.SIGTERM:d}\n"
