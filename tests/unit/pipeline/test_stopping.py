"""SIGTERM ends a run with its jobs, and is answered at once."""

import signal
import subprocess
import sys

import pytest

from pdrom.core.logs import INTERRUPTED

PLANS = """
import signal
from pdrom.pipeline.stopping import end_at_sigterm
end_at_sigterm()
print("ready", flush=True)
signal.pause()
"""

# A run with a job in a shell, as Snakemake waits for it; it prints how the job ended.
RUNS = """
import os, subprocess, sys
from pdrom.pipeline import stopping
stopping.PATIENCE = float(sys.argv[1])
stopping.stop_at_sigterm(lambda: os.write(1, b"noted\\n"))
job = subprocess.Popen(["sh", "-c", sys.argv[2]], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
ready = job.stdout.readline()
try:
    os.write(1, ready)
    job.wait()
except KeyboardInterrupt:
    print(job.wait(), flush=True)
"""


def sigterm(*command: str) -> tuple[int, str, str]:
    """Exit status, output and errors of a program that gets SIGTERM once it is ready."""
    process = subprocess.Popen(
        [sys.executable, "-c", *command],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGTERM)
    out, errors = process.communicate()
    return process.returncode, out, errors


def test_a_plan_ends_with_one_line():
    assert sigterm(PLANS) == (INTERRUPTED, "", "pdrom: ended by SIGTERM\n")


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


def test_a_run_whose_reader_is_gone_ends_too():
    """Nothing can be said, and the job is ended all the same."""
    process = subprocess.Popen(
        [sys.executable, "-c", RUNS, "1e6", "echo ready; read nothing"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "ready\n"
    process.stderr.close()
    process.send_signal(signal.SIGTERM)
    assert process.stdout.read() == f"noted\n{-signal.SIGTERM:d}\n"
    process.wait()
