"""Logs of jobs: messages, the usage in the last line, and the output of a failed job."""

import errno
import logging
import subprocess
import sys
import time

import numpy as np
import pytest
import scipy.linalg  # noqa: F401  -- loads libraries that have threads
from threadpoolctl import threadpool_info, threadpool_limits

from pdrom.core.errors import MeshError
from pdrom.core.store.checksum import sets_aside
from study.artifact.logs import job_log, usage_of, usage_since, warnings_to

LOGGER = logging.getLogger("pdrom")


@pytest.fixture(autouse=True)
def logger_is_as_before():
    before = (list(LOGGER.handlers), LOGGER.level)
    yield
    assert (list(LOGGER.handlers), LOGGER.level) == before


@pytest.fixture
def path(tmp_path):
    return tmp_path / "logs" / "rule" / "job.log"


def test_messages_of_the_package_are_in_the_log_of_the_last_job(path):
    with job_log(str(path)) as logger:
        logger.info("an earlier job")
    with job_log(str(path)):
        logging.getLogger("pdrom.model.mesh").info("made %d", 3)
        logging.getLogger("pdrom.model.mesh").debug("hidden")
        logging.getLogger("study.tables").info("wrote %d", 2)
        logging.getLogger("other").error("elsewhere")
    text = path.read_text()
    assert "INFO" in text
    first, second, last = text.splitlines()
    assert first.endswith("pdrom.model.mesh: made 3")
    assert second.endswith("study.tables: wrote 2")
    assert "pdrom: used " in last


def test_only_jobs_limit_libraries_to_one_thread_and_rename_damaged_results(path):
    """Snakemake would allow as many threads as cores, and timing jobs claim every core."""

    def threads() -> set[int]:
        return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

    with threadpool_limits(limits=2):
        assert threads() == {2}
        with pytest.raises(SystemExit), job_log(str(path)):
            assert threads() == {1}
            assert sets_aside()
            raise MeshError("x")
        assert threads() == {2}
        assert not sets_aside()


@pytest.mark.parametrize(
    ("failure", "said"),
    [
        (MemoryError("Unable to allocate 9 GiB"), "MemoryError: Unable to allocate 9 GiB"),
        (OSError(errno.ENOSPC, "No space", "a.h5"), "OSError: [Errno 28] No space: 'a.h5'"),
        (MeshError("a.obj: vertex 3 is nan"), "a.obj: vertex 3 is nan"),
    ],
)
def test_a_failed_job_ends_with_one_line(path, failure, said):
    """Errors of the user have no traceback; the log has it for all other errors."""
    with pytest.raises(SystemExit) as caught, job_log(str(path)):
        raise failure
    assert caught.value.code.startswith(f"pdrom: {said}")
    assert f"ERROR   pdrom: {said}" in path.read_text()
    if isinstance(failure, MeshError):
        assert caught.value.code == f"pdrom: {said}"
        assert "Traceback" not in path.read_text()
    else:
        assert caught.value.code.endswith(f" (traceback in {path})")
        assert "test_logs.py" in path.read_text()


def test_warnings_of_a_plan_are_shown_once(capsys):
    for stream in (sys.stderr, None):
        with warnings_to(stream):
            logging.getLogger("pdrom.anything").warning("look")
            logging.getLogger("pdrom.anything").info("not shown")
    assert capsys.readouterr().err == "pdrom: warning: look\n"


def test_usage_covers_the_process_and_the_processes_that_it_started():
    start = time.monotonic()
    before = usage_since(start)
    held = np.ones(8_000_000)  # 64 MB
    work = "import time\nwhile time.process_time() < 0.2: pass"
    subprocess.run([sys.executable, "-c", work], check=True)
    after = usage_since(start)
    assert after.processor - before.processor >= 0.2
    assert after.wall >= before.wall
    assert after.memory >= held.nbytes / 1e6


def test_the_log_of_a_failed_job_has_no_usage(tmp_path):
    with pytest.raises(SystemExit), job_log(str(tmp_path / "job.log")):
        raise MeshError("a.obj: vertex 3 is nan")
    (tmp_path / "empty.log").touch()
    assert {usage_of(tmp_path / f"{name}.log") for name in ("job", "none", "empty")} == {None}
