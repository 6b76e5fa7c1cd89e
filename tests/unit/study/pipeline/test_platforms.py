"""Machines without wheels are named with a remedy; the rest gets what it can have."""

import subprocess
import sys

import pytest

from study.pipeline import platforms
from study.pipeline.platforms import obstacle


@pytest.mark.parametrize(
    ("machine", "words"),
    [
        (("Linux", "x86_64", (3, 14), "glibc"), ("Python 3.14", "immutables", "PYTHON")),
        (("Linux", "x86_64", (3, 10), "glibc"), ("Python 3.10", "too old", "PYTHON")),
        (("Darwin", "x86_64", (3, 12), ""), ("macOS on Intel", "llvmlite", "container")),
        (("Linux", "x86_64", (3, 12), ""), ("without glibc", "llvmlite", "container")),
        (("Linux", "riscv64", (3, 12), "glibc"), ("Linux on riscv64", "use one of these")),
        (("FreeBSD", "amd64", (3, 12), ""), ("FreeBSD on amd64", "use one of these")),
    ],
)
def test_a_platform_without_wheels_is_named_with_the_remedy(machine, words):
    assert all(word in obstacle(*machine) for word in words)


@pytest.mark.parametrize("version", [(3, 11), (3, 12), (3, 13)])
@pytest.mark.parametrize(
    ("system", "processor", "libc"),
    [("Linux", "x86_64", "glibc"), ("Linux", "aarch64", "glibc"), ("Darwin", "arm64", "")],
)
def test_platforms_that_work(version, system, processor, libc):
    assert obstacle(system, processor, version, libc) is None


def test_it_runs_by_its_path_without_any_package():
    """As ``./reproduce`` runs it, before anything is installed."""
    command = [sys.executable, "-I", "-S", platforms.__file__]
    assert subprocess.run(command, check=True, capture_output=True).stdout == b""
