"""The lock of a folder: one holder, none that is stale, Snakemake's own lock files healed."""

import os
import signal
import subprocess
import sys

import pytest

from pdrom.pipeline.running import LOCK, SNAKEMAKE_LOCKS, AtWorkError, hold, remove_stale_locks

HOLDER = """
import sys, time
from pdrom.pipeline.running import hold
hold()
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Each test is at work in a folder of its own."""
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
    SNAKEMAKE_LOCKS.mkdir(parents=True)
    (SNAKEMAKE_LOCKS / "0.output.lock").write_text("results/x\n")


def test_the_second_process_names_the_first(other):
    with pytest.raises(AtWorkError, match=rf"process {other.pid} on .* is at work in this folder"):
        hold()
    assert LOCK.read_text().startswith(f"process {other.pid} ")


def test_a_lock_goes_with_its_process_however_it_ends(other):
    other.send_signal(signal.SIGKILL)
    other.wait()
    snakemake_lock()
    descriptor = hold()
    assert LOCK.read_text().startswith(f"process {os.getpid()} ")
    assert not SNAKEMAKE_LOCKS.exists()
    os.close(descriptor)


def test_a_lock_is_not_inherited_by_jobs():
    descriptor = hold()
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as job:
        os.close(descriptor)
        os.close(hold())
        job.communicate(b"\n")


def test_stale_locks_go_and_those_of_a_living_run_stay(other):
    snakemake_lock()
    remove_stale_locks()
    assert SNAKEMAKE_LOCKS.exists()
    other.kill()
    other.wait()
    remove_stale_locks()
    assert not SNAKEMAKE_LOCKS.exists()
    os.close(hold())


def test_a_folder_that_cannot_be_written_is_named(folder):
    (folder / ".snakemake").write_text("a file where the folder should be")
    with pytest.raises(AtWorkError, match=r"run\.lock: cannot be written"):
        hold()
