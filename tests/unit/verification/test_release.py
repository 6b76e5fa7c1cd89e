"""A release: one version everywhere, changes under its heading, nothing uncommitted."""

import tomllib

import pytest
from test_bundle import git

from pdrom import __version__
from pdrom.core.yamlfile import read_yaml
from pdrom.verification import release
from pdrom.verification.status import Status, ended
from places import ROOT

CHANGES = f"# Changes\n\n## Unreleased\n\n## {__version__}\n\n- one\n"


@pytest.fixture
def ready(tmp_path, monkeypatch):
    """A clone of which nothing speaks against a release."""
    (tmp_path / "CHANGELOG.md").write_text(CHANGES)
    (tmp_path / "CITATION.cff").write_text(f"version: {__version__}\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "first")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_version_has_one_source():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    assert "version" not in project["project"]
    assert project["project"]["dynamic"] == ["version"]
    path = project["tool"]["hatch"]["version"]["path"]
    assert f'__version__ = "{__version__}"' in (ROOT / path).read_text("utf-8")
    assert read_yaml(ROOT / "CITATION.cff")["version"] == __version__
    changes = (ROOT / release.CHANGES).read_text("utf-8")
    assert __version__ in dict(release.SECTION.findall(changes))


def test_a_clone_that_is_ready_is_bundled(ready, monkeypatch):
    monkeypatch.setattr(release, "bundle", lambda arguments: Status.HOLDS)
    assert release.release([]) == Status.HOLDS


@pytest.mark.parametrize(
    ("file", "text", "reason"),
    [
        ("CHANGELOG.md", "## Unreleased\n\n## 9.9.9\n", "has no heading '## "),
        ("CHANGELOG.md", CHANGES.replace("\n\n## 0", "\n- new\n\n## 0"), "under '## Unreleased'"),
        ("CITATION.cff", "version: 9.9.9\n", "names version 9.9.9, pdrom.__version__"),
    ],
)
def test_what_speaks_against_a_release_is_named(ready, monkeypatch, capsys, file, text, reason):
    monkeypatch.setattr(release, "bundle", lambda arguments: pytest.fail("it was bundled"))
    (ready / file).write_text(text)
    git(ready, "commit", "-q", "-a", "-m", "second")
    assert release.release([]) == Status.FAULTY
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"pdrom: release: {file} ")
    assert reason in line


@pytest.mark.parametrize("file", ["CITATION.cff", "new.txt"])
def test_what_is_in_no_commit_is_named(ready, capsys, file):
    (ready / file).write_text(f"version: {__version__}\n# edited\n")
    assert release.release([]) == Status.FAULTY
    assert f"in no commit: {file}; commit or remove" in capsys.readouterr().err


def test_a_missing_file_is_one_line(ready, capsys):
    (ready / "CHANGELOG.md").unlink()
    assert ended(lambda: release.release([])) == Status.FAULTY
    (line,) = capsys.readouterr().err.splitlines()
    assert "CHANGELOG.md" in line
