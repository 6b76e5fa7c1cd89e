"""The record of the machine."""

from importlib.metadata import version
from unittest.mock import Mock

from threadpoolctl import threadpool_info, threadpool_limits

from pdrom.core import machine as module
from pdrom.core.machine import loaded_kernels, machine


def test_the_record_names_threads_cores_processor_and_libraries():
    for threads in (2, 1):
        with threadpool_limits(limits=threads):
            record = machine()
        assert record.threads == threads
    assert record.cores >= 1
    assert record.cpu
    assert record.libraries["numpy"] == version("numpy")


def test_the_record_names_the_kernels_that_are_loaded():
    """NumPy and SciPy have one library each, and the record contains no path."""
    kernels = loaded_kernels()
    pools = threadpool_info()
    assert len(kernels) == len(pools)
    blas = {k["architecture"] for k in kernels if k["kind"] == "blas"}
    assert blas == {pool["architecture"] for pool in pools if pool["user_api"] == "blas"}
    assert None not in blas
    assert all("/" not in k["file"] and k["threads"] >= 1 for k in kernels)


def test_commit_is_unknown_without_git(monkeypatch):
    monkeypatch.setattr(module.subprocess, "run", Mock(side_effect=FileNotFoundError("git")))
    assert machine().commit == "unknown"
