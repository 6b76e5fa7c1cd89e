"""The script ``reproduce``: clear failures, one set-up at a time, arguments handed on."""

import os
import shutil
import signal
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
TOOLS = ["cat", "chmod", "cksum", "cp", "dirname", "grep", "mkdir", "rm", "sed", "sh"]
TOOLS += ["sleep", "tail", "touch", "tr"]
PLATFORMS = "src/study/pipeline/platforms.py"
PACKAGES = "lib/python3.12/site-packages"
FRONT = "python -m study.pipeline.front"
LOCK_FILE = f"nowhere==1.0 --hash=sha256:{64 * '0'}\n"

# Stands for a Python of a given version that makes environments out of itself.
PYTHON = """#!/bin/sh
case "$*" in
*print*version_info*) echo {version} ;;
*"sys.exit(sys.version_info"*) exit {too_old} ;;
*"import venv"*)
    touch searching
    while [ -e hold-search ]; do sleep 0.05; done
    exit {no_venv}
    ;;
*fcntl*) exec "{real}" "$@" ;;
*platforms.py*)
    [ ! -e unsupported ] || {{ echo "no wheel for it" >&2; exit 1; }}
    ;;
*"-m venv"*)
    mkdir -p "$3/bin" "$3/{packages}/numpy-2.1.0.dist-info"
    cp "$0" "$3/bin/python"
    ;;
*"-m pip"*)
    for number in 1 2 3 4 5 6 7 8 9 10 11; do echo "Collecting package$number"; done
    echo "Installing collected packages: all"
    touch installing
    while [ -e hold ]; do sleep 0.05; done
    [ ! -e pip-fails ] || {{ cat pip-fails; exit 1; }}
    ;;
*soundness*)
    echo "numpy 2.1.0: X.T @ X"
    [ ! -e broken ] || kill -SEGV $$
    ;;
*sysconfig*) echo "$PWD/.venv/{packages}" ;;
*) echo "python $*" >>calls ;;
esac
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
        platforms = self.path / PLATFORMS
        platforms.parent.mkdir(parents=True)
        shutil.copy(ROOT / PLATFORMS, platforms)
        self.path.joinpath("requirements.lock").write_text(LOCK_FILE, encoding="utf-8")

    def add_python(
        self, version: str = "3.12", too_old: bool = False, no_venv: bool = False
    ) -> None:
        """Put a stand-in for Python on the path."""
        text = PYTHON.format(
            version=version, too_old=int(too_old), no_venv=int(no_venv), real=sys.executable,
            packages=PACKAGES,
        )  # fmt: skip
        program = self.programs / "python3"
        program.write_text(text, encoding="utf-8")
        program.chmod(0o755)

    def start(
        self, *arguments: str, start_new_session: bool = False, **environment: str
    ) -> subprocess.Popen[str]:
        """Start the script from another working directory."""
        return subprocess.Popen(
            [self.path / "reproduce", *arguments],
            cwd="/",
            env={"PATH": str(self.programs), "HOME": str(self.path), **environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=start_new_session,
        )

    def refused(self, **environment: str) -> list[str]:
        """Lines on standard error of a run that fails."""
        status, errors = self.run(**environment)
        assert status != 0
        return errors

    def touch(self, name: str, text: str = "") -> None:
        """Write a file of the folder."""
        self.path.joinpath(name).write_text(text)

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
    """A folder with a Python that fits."""
    made = Folder(tmp_path)
    made.add_python()
    return made


def test_no_python(folder: Folder) -> None:
    folder.programs.joinpath("python3").unlink()
    (line,) = folder.refused()
    assert line.startswith("reproduce: Python 3.11, 3.12 or 3.13 is needed")
    assert line.endswith("found none (set PYTHON to its path)")


@pytest.mark.parametrize("version", ["3.9", "3.14"])
def test_a_python_without_wheels(version: str, folder: Folder) -> None:
    folder.add_python(version=version, too_old=True)
    (line,) = folder.refused()
    assert f"(some packages have no wheels for other ones), found only {version}" in line


def test_python_without_venv(folder: Folder) -> None:
    folder.add_python(no_venv=True)
    (line,) = folder.refused()
    assert "has no venv module" in line
    assert not (folder.path / ".venv").exists()


def test_a_folder_in_which_nothing_can_be_made(folder: Folder) -> None:
    folder.touch(".cache", "a file where the folder should be")
    errors = folder.refused()
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
    folder.programs.joinpath("python3").unlink()
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
    assert "the packages cannot be downloaded: no network? See " in line
    assert Path(line.partition("See ")[2]).is_file()


def test_a_failed_set_up_is_made_anew(folder: Folder) -> None:
    folder.touch("pip-fails", "ERROR: no\n")
    errors = folder.refused()
    assert errors[-1].startswith("reproduce: the packages cannot be installed")
    assert errors[-1].endswith("ERROR: no")
    assert folder.calls == []
    folder.path.joinpath("pip-fails").unlink()
    status, errors = folder.run()
    assert status == 0, errors
    assert folder.calls == [FRONT]


def test_the_environment_is_made_once_for_each_lock_file(folder: Folder) -> None:
    making = [any("making .venv" in line for line in folder.run()[1]) for _ in range(2)]
    folder.touch("requirements.lock", "")
    making.append(any("making .venv" in line for line in folder.run()[1]))
    assert making == [True, False, True]


@pytest.mark.parametrize("change", ["a version", "one more", "one less"])
def test_packages_that_another_program_changed_are_noticed(change: str, folder: Folder) -> None:
    folder.run()
    assert folder.run()[1] == ["reproduce: planning"]
    packages = folder.path / ".venv" / PACKAGES
    installed = packages / "numpy-2.1.0.dist-info"
    if change == "one more":
        (packages / "pdrom-0.1.0.dist-info").mkdir()
    elif change == "one less":
        installed.rmdir()
    else:
        installed.rename(packages / "numpy-2.2.0.dist-info")
    announcement, why, *_ = folder.run()[1]
    assert "making .venv" in announcement
    assert why == "reproduce: .venv holds other packages than those of requirements.lock"


def test_the_executor_for_clusters_may_be_added(folder: Folder) -> None:
    folder.run()
    for name in _locked("requirements-cluster.lock"):
        (folder.path / ".venv" / PACKAGES / f"{name.replace('-', '_')}-1.0.dist-info").mkdir()
    assert folder.run()[1] == ["reproduce: planning"]


def _locked(name: str) -> list[str]:
    lines = (ROOT / name).read_text("utf-8").splitlines()
    return [line.partition("==")[0] for line in lines if "==" in line]


@pytest.mark.parametrize("name", ["two\nlines", "ends\n"])
def test_a_path_with_a_line_break_is_refused(name: str, folder: Folder) -> None:
    folder.path = folder.path.rename(folder.path.with_name(name))
    (line,) = folder.refused()
    assert line.startswith("reproduce: ")
    assert "line break" in line
    assert not (folder.path / ".venv").exists()


def test_arguments_are_handed_on(folder: Folder) -> None:
    folder.run("-n", "results/figures/a b.pdf")
    folder.run("test", "-q", "tests/unit")
    assert folder.calls == [f"{FRONT} -n results/figures/a b.pdf", f"{FRONT} test -q tests/unit"]


def test_help_makes_nothing(folder: Folder) -> None:
    process = folder.start("--help")
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    for word in ("TARGETS", "--configfile", "-n", "--report", "test", "results/tables"):
        assert word in output
    assert "set -eu" not in output
    assert not (folder.path / ".venv").exists()


def test_set_up_shows_that_it_is_alive(folder: Folder) -> None:
    _, errors = folder.run()
    assert errors[1:] == [
        "reproduce: 10 of 1 packages",
        "reproduce: unpacking 11 packages",
        "reproduce: planning",
    ]


def test_only_what_plans_says_so(folder: Folder) -> None:
    folder.run()
    words = [folder.run(*arguments)[1] for arguments in ([], ["-n"], ["test"], ["run", "true"])]
    assert words == [["reproduce: planning"], ["reproduce: planning"], [], []]


def test_a_platform_without_wheels_ends_before_anything_is_made(folder: Folder) -> None:
    folder.touch("unsupported")
    errors = folder.refused()
    assert errors[-1] == "no wheel for it"
    assert not folder.path.joinpath("installing").exists()
    assert not (folder.path / ".venv").exists()


def test_a_full_disk_is_told_from_a_missing_network(folder: Folder) -> None:
    said = "ERROR: Could not install: [Errno 28] No space left on device (timed out)\n"
    folder.touch("pip-fails", said)
    errors = folder.refused()
    assert "no space left on the disk" in errors[-1]


def test_broken_linear_algebra_is_named_and_the_environment_does_not_count(folder: Folder) -> None:
    folder.touch("broken")
    for _ in range(2):
        assert folder.refused()[-1] == (
            "reproduce: linear algebra is broken on this machine: numpy 2.1.0: X.T @ X crashes "
            f"(signal 11), see {folder.path}/.cache/setup.log"
        )
        assert folder.calls == []
    folder.path.joinpath("broken").unlink()
    assert folder.run()[0] == 0
    assert folder.calls == [FRONT]


@pytest.fixture
def installing(folder: Folder) -> Iterator[tuple[Folder, subprocess.Popen[str]]]:
    """A set-up that stays at work."""
    folder.touch("hold")
    process = folder.start(start_new_session=True)
    limit = time.monotonic() + 60
    while not folder.path.joinpath("installing").exists() and time.monotonic() < limit:
        time.sleep(0.02)
    yield folder, process
    folder.path.joinpath("hold").unlink(missing_ok=True)
    process.communicate(timeout=60)


def test_the_second_of_two_set_ups_ends_at_once(
    installing: tuple[Folder, subprocess.Popen[str]],
) -> None:
    folder, first = installing
    errors = folder.refused()
    assert errors == [
        f"reproduce: another run (process {first.pid}, making .venv) is at work in this folder"
    ]
    folder.path.joinpath("hold").unlink()
    first.communicate(timeout=60)
    assert first.returncode == 0
    assert folder.run()[0] == 0
    assert len(folder.calls) == 2


def test_a_killed_set_up_leaves_no_lock(installing: tuple[Folder, subprocess.Popen[str]]) -> None:
    folder, first = installing
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate(timeout=60)
    folder.path.joinpath("hold").unlink()
    assert folder.run()[0] == 0
    assert folder.calls == [FRONT]


@pytest.mark.parametrize("whole", [True, False], ids=["all processes", "the script alone"])
def test_an_interrupted_set_up_ends_and_says_so(
    installing: tuple[Folder, subprocess.Popen[str]], whole: bool
) -> None:
    """It does not wait for the packages, which are no longer installed: the streams close."""
    folder, first = installing
    (os.killpg if whole else os.kill)(first.pid, signal.SIGTERM)
    _, errors = first.communicate(timeout=60)
    assert folder.path.joinpath("hold").exists()
    assert first.returncode == 130
    said = [line for line in errors.splitlines() if "packages" not in line]
    assert said[-1] == "reproduce: interrupted"
    assert folder.calls == []


def test_no_number_of_a_process_stays_that_a_later_set_up_would_kill(folder: Folder) -> None:
    folder.run()
    assert not folder.path.joinpath(".cache/pip.pid").exists()


def test_an_interrupted_set_up_kills_nothing_that_an_older_one_left(folder: Folder) -> None:
    folder.touch("hold-search")
    with subprocess.Popen(["sleep", "600"]) as stranger:
        folder.path.joinpath(".cache").mkdir()
        folder.touch(".cache/pip.pid", f"{stranger.pid}\n")
        process = folder.start()
        while not folder.path.joinpath("searching").exists():
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        folder.path.joinpath("hold-search").unlink()
        process.communicate(timeout=60)
        alive = stranger.poll() is None
        stranger.kill()
    assert process.returncode == 130
    assert alive
