"""The record of the machine."""

import subprocess
from importlib.metadata import version

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from pdrom.core import machine as module
from pdrom.core.machine import Kernels, loaded_kernels, machine


def test_it_names_threads_cores_processor_and_libraries():
    for threads in (2, 1):
        with threadpool_limits(limits=threads):
            record = machine()
        assert record.threads == threads
    assert record.cores >= 1
    assert record.cpu
    assert record.libraries["numpy"] == version("numpy")


def test_kernels_are_those_that_are_loaded():
    """NumPy and SciPy have a library each, and nothing says where they lie on the disk."""
    kernels = loaded_kernels()
    pools = threadpool_info()
    assert len(kernels) == len(pools)
    blas = {k.architecture for k in kernels if k.kind == "blas"}
    assert blas == {pool["architecture"] for pool in pools if pool["user_api"] == "blas"}
    assert None not in blas
    assert all("/" not in k.file and k.threads >= 1 for k in kernels)


def test_a_library_that_does_not_say_its_architecture_is_recorded_without(monkeypatch):
    pool = {"filepath": "/usr/lib/libgomp.so.1", "user_api": "openmp", "internal_api": "openmp"}
    monkeypatch.setattr(
        module, "threadpool_info", lambda: [{**pool, "version": None, "num_threads": 3}]
    )
    expected = Kernels(
        file="libgomp.so.1", kind="openmp", library="openmp",
        version=None, architecture=None, threads=3,
    )  # fmt: skip
    assert loaded_kernels() == (expected,)
    assert machine().threads == 3


@pytest.mark.parametrize(
    "failure",
    [FileNotFoundError("git"), subprocess.TimeoutExpired("git", 10), None],
    ids=["no git", "hanging", "no checkout"],
)
def test_commit_is_unknown_without_a_checkout(monkeypatch, failure):
    def run(command, **settings):
        if failure is not None:
            raise failure
        return subprocess.CompletedProcess(command, 128, stdout="", stderr="not a repository")

    monkeypatch.setattr(module.subprocess, "run", run)
    assert machine().commit == "unknown"
