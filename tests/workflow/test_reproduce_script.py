"""The script ``reproduce``: clear errors, one set-up at a time, arguments are passed on."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from places import ROOT
from study.pipeline.signals import ENDINGS

SCRIPT = ROOT / "reproduce"
TOOLS = ["cat", "chmod", "cksum", "cp", "dirname", "grep", "mkdir", "rm", "sed", "sh", "sleep"]
TOOLS += ["tail", "touch", "tr"]
PACKAGES = "lib/python3.12/site-packages"
FRONT = "python -m study.pipeline.front"
LOCK_FILE = f"nowhere==1.0 --hash=sha256:{64 * '0'}\n"

# Replaces a Python of a given version that makes environments.
PYTHON = """#!/bin/sh
case "$*" in
*print*version_info*) echo {version} ;;
*"sys.exit(sys.version_info"*) exit {too_old} ;;
*"import venv"*)
    exit {no_venv}
    ;;
*fcntl*) exec "{real}" "$@" ;;
*"-m venv"*)
    mkdir -p "$3/bin" "$3/{packages}/numpy-2.1.0.dist-info"
    cp "$0" "$3/bin/python"
    ;;
*"-m pip"*)
    for number in 1 2 3 4 5 6 7 8 9 10 11; do echo "Collecting package$number"; done
    case "$*" in
    *requirements-test.lock) mkdir -p ".venv/{packages}/types_PyYAML-6.dist-info" ;;
    esac
    echo "Installing collected packages: all"
    touch installing
    while [ -e hold ]; do sleep 0.05; done
    [ ! -e pip-fails ] || {{ cat pip-fails; exit 1; }}
    ;;
*sysconfig*) echo "$PWD/.venv/{packages}" ;;
*) echo "python $*" >>calls ;;
esac
"""


class Folder:
    """A folder with the script, and the programs that it can find."""

    def __init__(self, path: Path) -> None:
        self.path = path / "a folder"
        self.programs = path / "bin"
        self.python = self.programs / "python3"
        self.path.mkdir()
        self.programs.mkdir()
        for tool in TOOLS:
            self.programs.joinpath(tool).symlink_to(shutil.which(tool))
        shutil.copy(SCRIPT, self.path)
        self.path.joinpath("requirements.lock").write_text(LOCK_FILE, encoding="utf-8")
        for name in ("requirements-test.lock", "requirements-cluster.lock"):
            shutil.copy(ROOT / name, self.path)

    def add_python(self, version: str = "3.12", too_old: int = 0, no_venv: int = 0) -> None:
        values = {"version": version, "too_old": too_old, "no_venv": no_venv}
        text = PYTHON.format(**values, real=sys.executable, packages=PACKAGES)
        self.python.write_text(text, encoding="utf-8")
        self.python.chmod(0o755)

    def start(self, *arguments: str, new: bool = False, **environment: str) -> subprocess.Popen:
        """Start the script from another working directory, on request in a new session."""
        return subprocess.Popen(
            [self.path / "reproduce", *arguments],
            cwd="/", env={"PATH": str(self.programs), "HOME": str(self.path), **environment},
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            start_new_session=new,
        )  # fmt: skip

    def run(self, *arguments: str, **environment: str) -> tuple[int, list[str]]:
        """Exit status and lines on standard error."""
        process = self.start(*arguments, **environment)
        _, errors = process.communicate(timeout=120)
        return process.returncode, errors.splitlines()

    def refused(self, **environment: str) -> list[str]:
        """Lines on standard error of a run that fails."""
        status, errors = self.run(**environment)
        assert status != 0
        return errors

    def works(self) -> None:
        """A run that makes the environment and starts the pipeline."""
        assert self.run()[0] == 0
        assert self.calls == [FRONT]

    def touch(self, name: str, text: str = "") -> None:
        self.path.joinpath(name).write_text(text)

    def has(self, name: str) -> bool:
        return self.path.joinpath(name).exists()

    @property
    def calls(self) -> list[str]:
        """Programs that the script finally started, with their arguments."""
        path = self.path / "calls"
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """A folder with a suitable Python."""
    made = Folder(tmp_path)
    made.add_python()
    return made


def rename(folder: Folder, name: str) -> None:
    folder.path = folder.path.rename(folder.path.with_name(name))


NO_WHEELS = r"\(some packages have no wheels for other versions\), found only"
UNFIT = {
    "no python": (
        lambda f: f.python.unlink(),
        r"Python 3\.11, 3\.12 or 3\.13 is needed.*found none; install .* set PYTHON to its path",
    ),
    "an old python": (lambda f: f.add_python("3.9", too_old=1), f"{NO_WHEELS} 3.9; .*"),
    "no venv": (lambda f: f.add_python(no_venv=1), "has no venv module.*"),
    "nothing can be made": (lambda f: f.touch(".cache"), "no write permission in .*/a folder, .*"),
    "line break at the end": (lambda f: rename(f, "ends\n"), ".*line break.*"),
}


@pytest.mark.parametrize("what", UNFIT)
def test_an_unsuitable_machine_is_named_in_one_line_before_anything_is_installed(what, folder):
    change, words = UNFIT[what]
    change(folder)
    (line,) = folder.refused()
    assert re.fullmatch(f"pdrom: .*{words}", line)
    assert not folder.has(".venv")


FULL = "ERROR: Could not install: [Errno 28] No space left on device (timed out)\n"
FAILING = {
    "pip": ("pip-fails", "ERROR: no\n", "pdrom: the packages cannot be installed.*ERROR: no"),
    "a full disk, not the network": ("pip-fails", FULL, ".*no space left on the disk.*"),
}


@pytest.mark.parametrize("what", FAILING)
def test_a_failed_set_up_is_repeated(what, folder):
    name, text, words = FAILING[what]
    folder.touch(name, text)
    for _ in range(2):
        assert re.fullmatch(words, folder.refused()[-1])
        assert folder.calls == []
    folder.path.joinpath(name).unlink()
    folder.works()


def test_a_set_up_without_a_network_is_named(folder):
    folder.python.unlink()
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        closed_port = listener.getsockname()[1]
    announcement, line = folder.refused(
        PYTHON=getattr(sys, "_base_executable", sys.executable),
        PIP_INDEX_URL=f"http://127.0.0.1:{closed_port}/simple",
        PIP_CONFIG_FILE="/dev/null",
        PIP_NO_CACHE_DIR="1",
        PIP_RETRIES="0",
    )
    assert "making .venv" in announcement
    assert "the packages cannot be downloaded; check the network, or the proxy. See" in line
    assert Path(line.partition("See ")[2]).is_file()


def test_the_environment_is_made_once_for_each_lock_file(folder):
    making = [any("making .venv" in line for line in folder.run()[1]) for _ in range(2)]
    folder.touch("requirements.lock", "")
    making.append(any("making .venv" in line for line in folder.run()[1]))
    assert making == [True, False, True]
    # no process ID remains that a later set-up would kill
    assert not folder.has(".cache/pip.pid")


@pytest.mark.parametrize("change", ["a version", "one more"])
def test_packages_that_another_program_changed_are_noticed(change, folder):
    """The packages for clusters and the tools of the tests may be added."""
    folder.run()
    packages = folder.path / ".venv" / PACKAGES
    installed = packages / "numpy-2.1.0.dist-info"
    locks = (ROOT / f"requirements-{name}.lock" for name in ("cluster", "test"))
    lines = [line for lock in locks for line in lock.read_text("utf-8").splitlines()]
    for name in [line.partition("==")[0] for line in lines if "==" in line]:
        (packages / f"{name.replace('-', '_')}-1.0.dist-info").mkdir()
    assert folder.run()[1] == []
    if change == "one more":
        (packages / "pdrom-0.1.0.dist-info").mkdir()
    else:
        installed.rename(packages / "numpy-2.2.0.dist-info")
    announcement, why, *_ = folder.run()[1]
    assert "making .venv" in announcement
    assert why == "reproduce: the packages in .venv were not those of requirements.lock"


def test_only_the_tests_add_their_tools_and_only_where_one_is_missing(folder):
    """If tools cannot be added, the environment of the study stays unchanged."""
    folder.run()
    folder.touch("pip-fails", "ERROR: no\n")
    assert folder.run("test")[0] != 0
    assert folder.run() == (0, [])
    folder.path.joinpath("pip-fails").unlink()
    adding = [folder.run("test")[1][:1] for _ in range(2)]
    (folder.path / ".venv" / PACKAGES / "types_PyYAML-6.dist-info").rmdir()
    adding += [folder.run()[1], folder.run("test")[1][:1]]
    added = ["reproduce: adding the tests' tools to .venv (once)"]
    assert adding == [added, [], [], added]


def test_arguments_are_passed_to_the_pipeline(folder):
    """The set-up shows that it is still at work."""
    asked = (["-n", "results/figures/a b.pdf"], ["test", "-q", "tests/unit"], ["run", "true"], [])
    said = [folder.run(*arguments)[1] for arguments in asked]
    assert folder.calls == [" ".join([FRONT, *arguments]) for arguments in asked]
    assert said[0][1:] == ["reproduce: 10 of 1 packages", "reproduce: unpacking 11 packages"]
    assert said[1][0].startswith("reproduce: adding the tests' tools")
    assert said[2:] == [[], []]


@pytest.fixture
def installing(folder: Folder) -> Iterator[tuple[Folder, subprocess.Popen[str]]]:
    """A set-up that does not finish."""
    folder.touch("hold")
    process = folder.start(new=True)
    limit = time.monotonic() + 60
    while not folder.has("installing") and time.monotonic() < limit:
        time.sleep(0.02)
    yield folder, process
    folder.path.joinpath("hold").unlink(missing_ok=True)
    process.communicate(timeout=60)


def test_a_second_set_up_ends_at_once_while_the_first_is_at_work(installing):
    folder, first = installing
    (line,) = folder.refused()
    assert line.startswith(f"pdrom: another run (process {first.pid}, making .venv) uses this")
    folder.path.joinpath("hold").unlink()
    first.communicate(timeout=60)
    assert first.returncode == 0
    assert folder.run()[0] == 0
    assert len(folder.calls) == 2


@pytest.mark.parametrize(
    ("whole", "number"), [(True, signal.SIGINT), (True, signal.SIGHUP), (False, signal.SIGTERM)]
)
def test_a_set_up_that_is_ended_by_a_signal_says_so(installing, whole, number):
    """It does not wait for packages, whose installation has stopped: the streams close."""
    folder, first = installing
    (os.killpg if whole else os.kill)(first.pid, number)
    _, errors = first.communicate(timeout=60)
    assert folder.has("hold")
    assert first.returncode == 128 + number
    said = [line for line in errors.splitlines() if "packages" not in line]
    assert said[-1] == f"pdrom: {ENDINGS[number]}; run the same command again to continue"
    assert folder.calls == []
