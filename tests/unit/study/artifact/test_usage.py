"""What a job used is in the last line of its log."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import MeshError
from study.artifact.logs import job_log
from study.artifact.usage import Usage, usage_of, usage_since

AMOUNTS = st.floats(0.0, 1e6)


@given(AMOUNTS, AMOUNTS, AMOUNTS)
def test_what_is_written_is_read_back(tmp_path_factory, wall, processor, memory):
    log = tmp_path_factory.mktemp("log") / "x.log"
    log.write_text(f"2026-01-01 INFO pdrom: {Usage(wall, processor, memory)}\n")
    found = usage_of(log)
    assert found is not None
    assert found.wall == pytest.approx(wall, abs=1e-3)
    assert found.processor == pytest.approx(processor, abs=1e-3)
    assert found.memory == pytest.approx(memory, abs=0.1)


def test_processor_time_and_memory_are_those_of_the_process_and_of_what_it_started():
    start = time.monotonic()
    before = usage_since(start)
    held = np.ones(8_000_000)  # 64 MB
    work = "import time\nwhile time.process_time() < 0.2: pass"
    subprocess.run([sys.executable, "-c", work], check=True)
    after = usage_since(start)
    assert after.processor - before.processor >= 0.2
    assert after.wall >= before.wall
    assert after.memory >= held.nbytes / 1e6


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks on this platform")
def test_a_fork_begins_with_no_processor_time(tmp_path):
    sum(range(10**6))
    process = os.fork()
    if process == 0:
        with job_log(str(tmp_path / "job.log")):
            pass
        os._exit(0)
    os.waitpid(process, 0)
    used = usage_of(tmp_path / "job.log")
    assert used is not None
    assert used.processor < usage_since(time.monotonic()).processor


def test_a_job_that_failed_has_no_usage(tmp_path):
    log = str(tmp_path / "job.log")
    with pytest.raises(SystemExit), job_log(log):
        raise MeshError("a.obj: vertex 3 is nan")
    assert usage_of(log) is None
    assert usage_of(tmp_path / "none.log") is None
    (tmp_path / "empty.log").touch()
    assert usage_of(tmp_path / "empty.log") is None
