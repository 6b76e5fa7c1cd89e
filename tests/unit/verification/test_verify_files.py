"""The manifest notices every changed file, and `verify --files` names what makes it anew."""

import json
from pathlib import Path

import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.provenance import made_by
from pdrom.core.store import write_hdf5, write_table, write_text
from pdrom.pipeline import manifest
from pdrom.pipeline.folders import Folders
from pdrom.pipeline.manifest import read_manifest, write_manifest
from pdrom.verification.files import verify_files
from pdrom.verification.status import Status
from pdrom.verification.subject import Subject

NAMES = ("results/tables/a.csv", "results/fom/a/train.h5", "paper/main.pdf", "results/paper/m.tex")
OPTIONS = ("--configfile", "my study.yaml")
SUBJECT = Subject(OPTIONS, Folders())


@pytest.fixture(autouse=True)
def study(tmp_path, monkeypatch):
    """Results of every kind with their manifest; the plan is replaced by their names."""
    monkeypatch.chdir(tmp_path)
    with made_by("rule", {"a": 1}, "c0de"):
        write_table(pd.DataFrame({"x": [1.5, 2.5]}), NAMES[0])
        with write_hdf5(NAMES[1]) as file:
            file["x"] = [1.0, 2.0]
        write_text("a PDF", NAMES[2])
        write_text(r"\val", NAMES[3])
    monkeypatch.setattr(
        manifest, "study_files", lambda *_: [name for name in NAMES if Path(name).is_file()]
    )
    write_manifest(None, Folders(), OPTIONS)


def test_an_entry_has_checksums_and_what_made_the_file():
    files = read_manifest("results").files
    assert list(files) == ["../paper/main.pdf", "fom/a/train.h5", "paper/m.tex", "tables/a.csv"]
    assert {name for name, entry in files.items() if entry.sha256 is None} == {"fom/a/train.h5"}
    assert {(e.made_by, e.code_sha256) for e in files.values()} == {("rule", "c0de")}
    assert (
        "numpy"
        in read_manifest("results").environments[files["paper/m.tex"].environment][
            "library_versions"
        ]
    )


def test_equal_results_have_an_equal_manifest():
    before = Path("results/manifest.json").read_bytes()
    write_manifest(None, Folders(), OPTIONS)
    assert Path("results/manifest.json").read_bytes() == before


def test_intact_files_hold(capsys):
    assert verify_files(SUBJECT) is Status.HOLDS
    assert "4 of 4 files" in capsys.readouterr().out


@pytest.mark.parametrize("name", NAMES)
def test_a_changed_digit_is_noticed_and_its_command_named(name, capsys):
    path = Path(name)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))
    assert verify_files(SUBJECT) is Status.DIFFERS
    said = capsys.readouterr().out
    command = f"./reproduce --configfile 'my study.yaml' --force -- {name}"
    assert f"{name}: damaged (its checksum differs); make it anew by {command}\n" in said
    assert "3 of 4 files" in said


def test_a_lost_file_has_a_code_of_its_own(capsys):
    Path(NAMES[0]).unlink()
    assert verify_files(SUBJECT) is Status.MISSING
    assert f"{NAMES[0]}: not there; make it anew by" in capsys.readouterr().out
    Path(NAMES[1]).write_bytes(b"")
    assert verify_files(SUBJECT) is Status.DIFFERS


def test_damage_before_the_manifest_is_noticed_after_it():
    """A later run does not take a damaged file for a good one."""
    Path(NAMES[0]).write_text("x\n1.5\n2.6\n")
    write_manifest(None, Folders(), OPTIONS)
    assert verify_files(SUBJECT) is Status.DIFFERS


def test_a_file_that_was_removed_leaves_the_manifest():
    Path(NAMES[0]).unlink()
    write_manifest(None, Folders(), OPTIONS)
    assert "tables/a.csv" not in read_manifest("results").files
    assert verify_files(SUBJECT) is Status.HOLDS


@pytest.mark.parametrize("content", ["{", '{"format": 2}', '{"format": 1, "file": {}}'])
def test_a_manifest_that_is_none_is_said(content, capsys):
    write_text(content, "results/manifest.json")
    with pytest.raises(StorageError, match=r"manifest\.json: "):
        read_manifest("results")
    assert verify_files(SUBJECT) is Status.DIFFERS
    assert "a run that succeeds writes it: ./reproduce --configfile" in capsys.readouterr().out


def test_an_edited_manifest_is_damaged_and_a_lost_one_missing():
    path = Path("results/manifest.json")
    text = json.loads(path.read_text())
    text["files"].popitem()
    path.write_text(json.dumps(text))
    assert verify_files(SUBJECT) is Status.DIFFERS
    path.unlink()
    assert verify_files(SUBJECT) is Status.MISSING
