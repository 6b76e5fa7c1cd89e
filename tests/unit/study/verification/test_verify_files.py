"""`verify --files`: changed, lost, unlisted, foreign files, and others than their inputs give."""

import json
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.provenance import made_by
from pdrom.core.store import atomic_path, write_hdf5, write_table, write_text
from places import ROOT
from study.article.build import article
from study.artifact.artifact import Artifact
from study.artifact.paths import TABLE, File, Place
from study.figures.kit.declaration import declarations
from study.live.page import live_page
from study.paper.build import paper_inputs
from study.pipeline import manifest
from study.pipeline.folders import Folders
from study.pipeline.manifest import read_manifest, write_manifest
from study.pipeline.resolve import Job
from study.tables import declared
from study.verification import files
from study.verification.files import differing, verify_files
from study.verification.subject import Status, Subject

NAMES = ("results/tables/a.csv", "results/fom/a/train.h5", "paper/main.pdf", "results/paper/m.tex")
OPTIONS = ("--configfile", "my study.yaml")
SUBJECT = Subject(OPTIONS, Folders())


def _doubled(table: File, out: File) -> None:
    """A manuscript made from a table."""
    Path(out.path).write_text(Path(table.path).read_text().replace("1.5", "3.0"))


def _broken(table: File, out: File) -> None:
    raise KeyError("no such column")


def _pages(page: File, other: File) -> None:
    for file, text in ((page, "all"), (other, "one")):
        write_text(text, file.path)


TABLES, PDF = {"table": TABLE}, {"out": Place("main.pdf")}
MANUSCRIPT = Artifact("MANUSCRIPT", "", TABLES, PDF, _doubled)
BROKEN = Artifact("BROKEN", "", TABLES, PDF, _broken)
PLACES = {"page": Place("a.html"), "other": Place("tables/a.html")}
PAGES = Artifact("PAGES", "", {}, PLACES, _pages)


def job_of(artifact: Artifact) -> Job:
    return Job(artifact, {}, {"table": NAMES[0]}, {"out": NAMES[2]}, {}, "", "")


@pytest.fixture(autouse=True)
def study(tmp_path, monkeypatch):
    """Results of every kind with their manifest; the plan is replaced by their names."""
    monkeypatch.chdir(tmp_path)
    with made_by("rule", {"a": 1}, "c0de"):
        write_table(pd.DataFrame({"x": [1.5, 2.5]}), NAMES[0])
        with write_hdf5(NAMES[1]) as file:
            file["x"] = [1.0, 2.0]
        write_text("x\n3.0\n2.5\n", NAMES[2])
        write_text(r"\val", NAMES[3])
    plan = SimpleNamespace(fixed={"paper": [job_of(MANUSCRIPT)]})
    monkeypatch.setitem(vars(SUBJECT), "plan", plan)
    monkeypatch.setattr(files, "own_files", lambda *_: set(NAMES))
    monkeypatch.setattr(files, "asked_for", lambda paths, *_: [])
    renew_checksum(monkeypatch)


def renew_checksum(monkeypatch):
    """Write the manifest of what is there, as a run does or somebody who hides an edit."""
    found = [name for name in NAMES if Path(name).is_file()]
    monkeypatch.setattr(manifest, "study_files", lambda *_: found)
    write_manifest(None, Folders(), OPTIONS)


def rewrite(change):
    """Another manifest, with new checksums."""
    path = Path("results/manifest.json")
    content = json.loads(path.read_text())
    change(content["files"])
    write_text(json.dumps(content), path)


def test_an_entry_has_checksums_and_what_made_the_file_and_equal_results_have_equal_entries():
    entries = read_manifest("results").files
    assert list(entries) == ["../paper/main.pdf", "fom/a/train.h5", "paper/m.tex", "tables/a.csv"]
    assert {name for name, e in entries.items() if e.sha256 is None} == {"fom/a/train.h5"}
    assert {(e.made_by, e.code_sha256) for e in entries.values()} == {("rule", "c0de")}
    environment = entries["paper/m.tex"].environment
    assert "numpy" in read_manifest("results").environments[environment]["library_versions"]
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
    assert f"{name}: damaged (its checksum differs); make it again by {command}\n" in said
    assert "3 of 4 files" in said


@pytest.mark.parametrize("content", ["x\n3.0\n2.6\n", "", "a picture"])
def test_a_file_with_checksum_that_its_inputs_do_not_give_is_noticed(content, monkeypatch, capsys):
    write_text(content, NAMES[2])
    renew_checksum(monkeypatch)
    assert verify_files(SUBJECT) is Status.DIFFERS
    assert f"{NAMES[2]}: not what its inputs give; make it again by" in capsys.readouterr().out


@pytest.mark.parametrize("name", NAMES)
def test_an_entry_that_was_taken_out_is_noticed(name, capsys):
    rewrite(lambda entries: entries.pop(f"../{name}".replace("../results/", "")))
    assert verify_files(SUBJECT) is Status.DIFFERS
    assert f"{name}: not in the manifest; make it again by" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["../../secret", "/etc/hostname", "../paper/main.tex", "notes.md"])
def test_a_name_that_is_no_file_of_the_study_is_noticed(name, capsys):
    rewrite(lambda entries: entries.update({name: entries["tables/a.csv"]}))
    assert verify_files(SUBJECT) is Status.DIFFERS
    assert ": no file of this study\n" in capsys.readouterr().out


def test_what_a_target_names_beside_the_study_may_be_listed(monkeypatch):
    monkeypatch.setattr(files, "own_files", lambda *_: set(NAMES[1:]))
    monkeypatch.setattr(files, "asked_for", lambda paths, *_: [NAMES[0]])
    assert verify_files(SUBJECT) is Status.HOLDS


def test_many_faults_are_counted(monkeypatch, capsys):
    more = {f"results/tables/{i}.csv" for i in range(30)}
    monkeypatch.setattr(files, "own_files", lambda *_: {*NAMES, *more})
    assert verify_files(SUBJECT) is Status.MISSING
    said = capsys.readouterr().out
    assert "and 10 more; finish the study by ./reproduce --configfile 'my study.yaml'\n" in said
    assert "4 of 34 files" in said


@pytest.mark.parametrize("content", ["{", '{"format": 2}', '{"format": 1, "file": {}}'])
def test_a_manifest_that_is_none_is_said(content, capsys):
    write_text(content, "results/manifest.json")
    with pytest.raises(StorageError, match=r"manifest\.json: "):
        read_manifest("results")
    assert verify_files(SUBJECT) is Status.DIFFERS
    assert "a run that succeeds writes it: ./reproduce --configfile" in capsys.readouterr().out


def broken_maker(monkeypatch):
    """What made a file fails now."""
    monkeypatch.setattr(SUBJECT.plan, "fixed", {"paper": [job_of(BROKEN)]})


def lost_checksum(_):
    Path(NAMES[3]).with_name(".m.tex.blake2b").unlink()


def lost_and_unlisted(monkeypatch):
    Path(NAMES[3]).unlink()
    renew_checksum(monkeypatch)
    assert "paper/m.tex" not in read_manifest("results").files


def damaged_before_a_later_run(_):
    Path(NAMES[0]).write_text("x\n1.5\n2.6\n")
    write_manifest(None, Folders(), OPTIONS)


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        (broken_maker, Status.DIFFERS),
        (lost_checksum, Status.DIFFERS),
        (damaged_before_a_later_run, Status.DIFFERS),
        (lost_and_unlisted, Status.MISSING),
        (lambda _: Path("results/manifest.json").unlink(), Status.MISSING),
    ],
)
def test_a_fault_is_noticed(fault, status, monkeypatch):
    fault(monkeypatch)
    assert verify_files(SUBJECT) is status


def test_a_lost_file_is_named(capsys):
    Path(NAMES[0]).unlink()
    assert verify_files(SUBJECT) is Status.MISSING
    assert f"{NAMES[0]}: not there; make it again by" in capsys.readouterr().out


def test_outputs_of_one_name_stay_apart():
    """A page of the article has the name of a table's page in a folder of its own."""
    paths = {"page": "results/article/a.html", "other": "results/article/tables/a.html"}
    job = Job(PAGES, {}, {}, paths, {}, "", "")
    job.make(paths)
    assert differing(job) == []
    write_text("another", paths["other"])
    assert differing(job) == [paths["other"]]


def test_a_figure_is_drawn_again_to_the_byte(results, subject):
    """Replaced, with new checksums, by a figure that its table does not give, or another's."""
    job = subject.plan.job(declarations()["singular_values"])  # which reads one table
    with files.made(job) as made:
        for path, new in made.items():
            with atomic_path(path) as temporary:
                temporary.write_bytes(new.read_bytes())
    assert differing(job) == []
    for path in job.outputs.values():
        content = Path(path).read_bytes()
        for other, faults in ((content + b"%", [path]), (content, [])):
            with atomic_path(path) as temporary:
                temporary.write_bytes(other)
            assert differing(job) == faults
    [table] = [path for path in job.files if path.startswith("results/")]
    write_table(pd.read_csv(table).assign(relative=0.5), table)
    assert differing(job) == list(job.outputs.values())


def test_every_artifact_that_takes_seconds_is_made_again(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    plan, folders = subject.plan, subject.folders
    known = [*declared().values(), *declarations().values(), paper_inputs, live_page, article]
    wanted = [place.at(folders.results) for one in known for place in one.writes.values()]
    assert sorted(plan.made) == sorted([*wanted, *folders.documents.values()])
