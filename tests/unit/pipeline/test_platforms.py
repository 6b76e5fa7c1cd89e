"""Machines without wheels are named with a remedy; the rest gets what it can have."""

import subprocess
import sys
from pathlib import Path

import pytest

from pdrom.pipeline import platforms
from pdrom.pipeline.platforms import Machine, without

ROOT = Path(platforms.__file__).parents[3]
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("machine", "words"),
    [
        (Machine("Linux", "x86_64", (3, 14), "glibc"), ("Python 3.14", "immutables", "PYTHON")),
        (Machine("Linux", "x86_64", (3, 10), "glibc"), ("Python 3.10", "too old", "PYTHON")),
        (Machine("Darwin", "x86_64", (3, 12), ""), ("macOS on Intel", "llvmlite", "container")),
        (Machine("Linux", "x86_64", (3, 12), ""), ("without glibc", "llvmlite", "container")),
        (Machine("Linux", "riscv64", (3, 12), "glibc"), ("Linux on riscv64", "use one of these")),
        (Machine("FreeBSD", "amd64", (3, 12), ""), ("FreeBSD on amd64", "use one of these")),
    ],
)
def test_a_platform_without_wheels_is_named_with_the_remedy(machine, words):
    assert all(word in machine.obstacle() for word in words)


@pytest.mark.parametrize("version", [(3, 11), (3, 12), (3, 13)])
@pytest.mark.parametrize(
    ("system", "processor", "libc", "left_out"),
    [
        ("Linux", "x86_64", "glibc", ()),
        ("Linux", "aarch64", "glibc", ("cholespy",)),
        ("Darwin", "arm64", "", ()),
    ],
)
def test_platforms_that_work(version, system, processor, libc, left_out):
    machine = Machine(system, processor, version, libc)
    assert machine.obstacle() is None
    assert machine.left_out() == left_out


def test_a_package_is_left_out_with_its_hashes():
    assert without(LOCK, ()) == LOCK
    short = without(LOCK, ("cholespy",)).splitlines()
    gone = [line for line in LOCK.splitlines() if line not in set(short)]
    assert gone[0].startswith("cholespy==")
    assert all(line.startswith("    --hash=") for line in gone[1:])
    assert len(LOCK.splitlines()) == len(short) + len(gone)


def test_it_runs_by_its_path_without_any_package(tmp_path):
    """As ``./reproduce`` runs it, before anything is installed."""
    target = tmp_path / "requirements.lock"
    command = [sys.executable, "-I", "-S", platforms.__file__, ROOT / "requirements.lock", target]
    subprocess.run(command, check=True)
    assert target.read_text().startswith("# Hash-pinned")
    assert "numpy==" in target.read_text()
