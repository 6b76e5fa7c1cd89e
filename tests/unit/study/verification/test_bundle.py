"""The archive for publication: its contents, equal bytes, and the error of an unfinished study."""

import os
import subprocess
import tarfile

import pytest

from pdrom.core.errors import ConfigurationError
from study.pipeline.folders import Folders
from study.verification import command
from study.verification.command import write_archive
from study.verification.subject import Status, Subject


def git(folder, *arguments: str) -> None:
    """Run a command of git that needs no settings of the user."""
    who = {
        f"GIT_{role}_{key}": "a@b" for role in ("AUTHOR", "COMMITTER") for key in ("NAME", "EMAIL")
    }
    subprocess.run(["git", *arguments], cwd=folder, check=True, env={**os.environ, **who})


@pytest.fixture
def clone(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "text.md").write_text("words\n")
    (tmp_path / "run").write_text("#!/bin/sh\n")
    (tmp_path / "run").chmod(0o755)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "first")
    return tmp_path


def test_an_archive_contains_the_commit_and_the_results_in_equal_bytes(
    clone, tmp_path, monkeypatch
):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000")
    (clone / "untracked.txt").write_text("mine\n")
    made = {"b": clone / "run", "a.txt": clone / "sub" / "text.md"}
    write_archive(clone, made, tmp_path / "one")
    (clone / "run").touch()
    write_archive(clone, dict(reversed(made.items())), tmp_path / "two")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    with tarfile.open(tmp_path / "one") as archive:
        found = {m.name.split("/", 1)[1]: bool(m.mode & 0o100) for m in archive if m.isfile()}
        assert {m.mtime for m in archive if m.name.endswith(("a.txt", "/b"))} == {1000}
    assert found == {"run": True, "sub/text.md": False, "a.txt": False, "b": False}


def test_changes_that_are_in_no_commit_are_refused(clone, tmp_path):
    (clone / "sub" / "text.md").write_text("other words\n")
    with pytest.raises(ConfigurationError, match=r"uncommitted .* sub/text\.md; commit"):
        write_archive(clone, {}, tmp_path / "one")
    assert not (tmp_path / "one").exists()


def test_without_a_finished_run_the_command_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Subject, "of", lambda *_: Subject(("--configfile", "a.yaml"), Folders()))
    assert command.bundle([]) is Status.MISSING
    assert (
        "successful run writes it, run ./reproduce --configfile a.yaml" in capsys.readouterr().out
    )
