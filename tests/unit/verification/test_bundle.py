"""The archive for publication: what is in it, equal bytes, and what an unfinished study says."""

import os
import subprocess
import tarfile

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.pipeline.folders import Folders
from pdrom.verification import bundle
from pdrom.verification.bundle import Member, sources, write_archive
from pdrom.verification.status import Status
from pdrom.verification.subject import Subject

MEMBERS = [Member("b/run", b"#!/bin/sh\n", True), Member("a.txt", b"text\n")]


def git(folder, *arguments: str) -> None:
    """A command of git that needs no settings of the user."""
    who = {
        f"GIT_{role}_{key}": "a@b" for role in ("AUTHOR", "COMMITTER") for key in ("NAME", "EMAIL")
    }
    subprocess.run(["git", *arguments], cwd=folder, check=True, env={**os.environ, **who})


@pytest.fixture
def clone(tmp_path):
    """A repository with two files, one of them executable."""
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "text.md").write_text("words\n")
    (tmp_path / "run").write_text("#!/bin/sh\n")
    (tmp_path / "run").chmod(0o755)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "first")
    return tmp_path


def test_an_archive_is_sorted_and_has_equal_bytes(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000")
    for name, members in {"one": MEMBERS, "two": MEMBERS[::-1]}.items():
        write_archive(members, tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    with tarfile.open(tmp_path / "one") as archive:
        found = [(m.name.split("/", 1)[1], m.mode, m.mtime, m.uid) for m in archive.getmembers()]
        assert found == [("a.txt", 0o644, 1000, 0), ("b/run", 0o755, 1000, 0)]


def test_sources_are_those_of_the_last_commit(clone):
    (clone / "untracked.txt").write_text("mine\n")
    assert {m.name: m.executable for m in sources(clone)} == {"run": True, "sub/text.md": False}
    (clone / "sub" / "text.md").write_text("other words\n")
    with pytest.raises(ConfigurationError, match=r"in no commit: sub/text\.md; commit"):
        list(sources(clone))


def test_sources_without_git_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    with pytest.raises(ConfigurationError, match="no git or no clone"):
        list(sources(tmp_path))


def test_without_a_finished_run_the_command_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Subject, "of", lambda *_: Subject(("--configfile", "a.yaml"), Folders()))
    assert bundle.bundle([]) is Status.MISSING
    assert (
        "a run that succeeds writes it: ./reproduce --configfile a.yaml" in capsys.readouterr().out
    )
