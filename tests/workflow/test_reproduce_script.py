"""The script ``reproduce``: clear failures, one run at a time, arguments handed on."""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from places import ROOT

SCRIPT = ROOT / "reproduce"
TOOLS = ["cat", "chmod", "cksum", "cp", "dirname", "find", "grep", "mkdir", "ps", "rm", "sed", "sh"]
TOOLS += ["sleep", "tail", "touch", "tr"]
OPTIONS = "--scheduler greedy --max-jobs-per-timespan 1000/20s --rerun-incomplete"
LOCK_FILE = f"nowhere==1.0 --hash=sha256:{64 * '0'}\n"

# Stands for a Python of a given version that makes environments out of itself.
PYTHON = """#!/bin/sh
case "$*" in
*print*version_info*) echo {version} ;;
*"sys.exit(sys.version_info"*) exit {too_old} ;;
*"import venv"*) exit {no_venv} ;;
*"-m venv"*)
    mkdir -p "$3/bin" "$3/packages"
    cp "$0" "$3/bin/python"
    cp "$0.snakemake" "$3/bin/snakemake"
    ;;
*"-m pip"*) [ ! -e pip-fails ] || {{ echo "ERROR: disk full"; exit 1; }} ;;
*sysconfig*) echo "$PWD/.venv/packages" ;;
*) echo "python $*" >>calls ;;
esac
"""
# Notes its arguments and stays until the file `hold` is gone.
SNAKEMAKE = """#!/bin/sh
echo "snakemake $*" >>calls
while [ -e hold ]; do sleep 0.05; done
"""


class Folder:
    """A folder with the script, and the programs that it may find."""

    def __init__(self, path: Path) -> None:
        self.path = path / "a folder"
        self.programs = path / "bin"
        self.path.mkdir()
        self.programs.mkdir()
        for tool in TOOLS:
            self.programs.joinpath(tool).symlink_to(shutil.which(tool))
        shutil.copy(SCRIPT, self.path)
        self.path.joinpath("requirements.lock").write_text(LOCK_FILE, encoding="utf-8")

    def add_python(
        self, version: str = "3.12", too_old: bool = False, no_venv: bool = False
    ) -> None:
        """Put a stand-in for Python on the path."""
        text = PYTHON.format(version=version, too_old=int(too_old), no_venv=int(no_venv))
        for name, content in (("python3", text), ("python3.snakemake", SNAKEMAKE)):
            self.programs.joinpath(name).write_text(content, encoding="utf-8")
            self.programs.joinpath(name).chmod(0o755)

    def start(self, *arguments: str, **environment: str) -> subprocess.Popen[str]:
        """Start the script from another working directory."""
        return subprocess.Popen(
            [self.path / "reproduce", *arguments],
            cwd="/",
            env={"PATH": str(self.programs), "HOME": str(self.path), **environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *arguments: str, **environment: str) -> tuple[int, list[str]]:
        """Exit status and lines on standard error."""
        process = self.start(*arguments, **environment)
        _, errors = process.communicate(timeout=120)
        return process.returncode, errors.splitlines()

    @property
    def calls(self) -> list[str]:
        """Programs that the script ended in, with their arguments."""
        path = self.path / "calls"
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


def test_no_python(folder: Folder) -> None:
    status, errors = folder.run()
    assert status != 0
    assert errors == [
        "reproduce: Python 3.11 or newer is needed, found none (set PYTHON to its path)"
    ]


def test_old_python(folder: Folder) -> None:
    folder.add_python(version="3.9", too_old=True)
    status, errors = folder.run()
    assert status != 0
    (line,) = errors
    assert "Python 3.11 or newer is needed, found only 3.9" in line


def test_python_without_venv(folder: Folder) -> None:
    folder.add_python(no_venv=True)
    status, errors = folder.run()
    assert status != 0
    (line,) = errors
    assert "has no venv module" in line
    assert not (folder.path / ".venv").exists()


def test_a_folder_in_which_nothing_can_be_made(folder: Folder) -> None:
    folder.add_python()
    folder.path.joinpath(".cache").write_text("a file where the folder should be")
    status, errors = folder.run()
    assert status != 0
    assert errors == [f"reproduce: no write permission in {folder.path}"]


@pytest.fixture
def readable_by_all() -> Iterator[Path]:
    """A folder outside pytest's own, which only its owner may enter."""
    path = Path(tempfile.mkdtemp())
    path.chmod(0o755)
    yield path
    shutil.rmtree(path)


def test_a_folder_of_another_user(readable_by_all: Path) -> None:
    folder = Folder(readable_by_all)
    folder.path.chmod(0o555)
    command = [str(folder.path / "reproduce")]
    if os.geteuid() == 0:  # root may write anywhere
        setpriv = shutil.which("setpriv")
        if setpriv is None:
            pytest.skip("running as root, without setpriv to become somebody else")
        command = [setpriv, "--reuid=65534", "--regid=65534", "--clear-groups", *command]
    environment = {"PATH": str(folder.programs)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    folder.path.chmod(0o755)
    assert done.returncode != 0
    assert done.stderr.splitlines() == [f"reproduce: no write permission in {folder.path}"]


def test_no_network(folder: Folder) -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        closed_port = listener.getsockname()[1]
    status, errors = folder.run(
        PYTHON=getattr(sys, "_base_executable", sys.executable),
        PIP_INDEX_URL=f"http://127.0.0.1:{closed_port}/simple",
        PIP_CONFIG_FILE="/dev/null",
        PIP_NO_CACHE_DIR="1",
        PIP_RETRIES="0",
    )
    assert status != 0
    announcement, line = errors
    assert "making .venv" in announcement
    assert "the packages cannot be downloaded: no network? See " in line
    assert Path(line.partition("See ")[2]).is_file()


def test_a_failed_set_up_is_made_anew(folder: Folder) -> None:
    folder.add_python()
    folder.path.joinpath("pip-fails").touch()
    status, errors = folder.run()
    assert status != 0
    assert errors[-1].startswith("reproduce: the packages cannot be installed")
    assert errors[-1].endswith("ERROR: disk full")
    assert folder.calls == []
    folder.path.joinpath("pip-fails").unlink()
    status, errors = folder.run()
    assert status == 0, errors
    assert folder.calls == [f"snakemake --cores all {OPTIONS}"]


def test_the_environment_is_made_once_for_each_lock_file(folder: Folder) -> None:
    folder.add_python()
    making = [any("making .venv" in line for line in folder.run()[1]) for _ in range(2)]
    folder.path.joinpath("requirements.lock").write_text("")
    making.append(any("making .venv" in line for line in folder.run()[1]))
    assert making == [True, False, True]


def test_arguments_are_handed_on(folder: Folder) -> None:
    folder.add_python()
    folder.run("-n", "results/figures/a b.pdf")
    folder.run("--cores", "1")
    folder.run("-j2")
    folder.run("test", "-q", "tests/unit")
    assert folder.calls == [
        f"snakemake --cores all {OPTIONS} -n results/figures/a b.pdf",
        f"snakemake {OPTIONS} --cores 1",
        f"snakemake {OPTIONS} -j2",
        "python -m pytest -q tests/unit",
    ]


def test_help_makes_nothing(folder: Folder) -> None:
    process = folder.start("--help")
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert "./reproduce test" in output
    assert not (folder.path / ".venv").exists()


@pytest.fixture
def held(folder: Folder) -> Iterator[tuple[Folder, subprocess.Popen[str]]]:
    """A run that stays at work."""
    folder.add_python()
    folder.path.joinpath("hold").touch()
    process = folder.start()
    limit = time.monotonic() + 30
    while not folder.calls and time.monotonic() < limit:
        time.sleep(0.02)
    yield folder, process
    folder.path.joinpath("hold").unlink(missing_ok=True)
    process.communicate(timeout=30)


def test_the_second_of_two_runs_ends_at_once(held: tuple[Folder, subprocess.Popen[str]]) -> None:
    folder, first = held
    status, errors = folder.run()
    assert status != 0
    assert errors == [
        f"reproduce: another ./reproduce (process {first.pid}) is at work in this folder"
    ]
    folder.path.joinpath("hold").unlink()
    first.communicate(timeout=30)
    assert first.returncode == 0
    assert folder.run()[0] == 0
    assert len(folder.calls) == 2


def test_a_killed_run_leaves_no_lock(held: tuple[Folder, subprocess.Popen[str]]) -> None:
    folder, first = held
    first.kill()
    first.communicate(timeout=30)
    folder.path.joinpath("hold").unlink()
    snakemake_lock = folder.path / ".snakemake" / "locks"
    snakemake_lock.mkdir(parents=True)
    status, errors = folder.run()
    assert (status, errors) == (0, [])
    assert not snakemake_lock.exists()
