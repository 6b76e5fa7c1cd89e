"""`verify --files`: changed, missing, unlisted and foreign files, and files of other inputs."""

import json
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.provenance import made_by
from pdrom.core.store import write_hdf5, write_table, write_text
from places import ROOT
from study.article.build import article
from study.artifact.artifact import Artifact
from study.artifact.paths import TABLE, File, Place
from study.figures.kit.declaration import declarations
from study.live.page import live_page
from study.paper.build import paper_inputs
from study.pipeline.folders import Folders
from study.pipeline.manifest import read_manifest, write_manifest
from study.pipeline.plan import Job
from study.tables import declared
from study.verification.subject import Status, Subject, differing, verify_files

NAMES = ("results/tables/a.csv", "results/fom/a/train.h5", "paper/main.pdf", "results/paper/m.tex")
OPTIONS = ("--configfile", "my study.yaml")
SUBJECT = Subject(OPTIONS, Folders())


def _doubled(table: File, out: File) -> None:
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
    fixed = {"paper": [job_of(MANUSCRIPT)]}
    plan = SimpleNamespace(fixed=fixed, own_files=set(NAMES), results="results")
    monkeypatch.setitem(vars(SUBJECT), "plan", plan)
    write_manifest(plan, OPTIONS)


def rewrite(change):
    path = Path("results/manifest.json")
    content = json.loads(path.read_text())
    change(content["files"])
    write_text(json.dumps(content), path)


def test_a_manifest_entry_has_checksums_and_provenance_equal_for_equal_results():
    entries = read_manifest("results").files
    assert list(entries) == ["../paper/main.pdf", "fom/a/train.h5", "paper/m.tex", "tables/a.csv"]
    assert {(e.made_by, e.code_sha256) for e in entries.values()} == {("rule", "c0de")}
    before = Path("results/manifest.json").read_bytes()
    write_manifest(SUBJECT.plan, OPTIONS)
    assert Path("results/manifest.json").read_bytes() == before


def test_intact_files_pass(capsys):
    assert verify_files(SUBJECT) is Status.HOLDS
    assert "4 of 4 files" in capsys.readouterr().out


def flipped(name, _):
    content = bytearray(Path(name).read_bytes())
    content[len(content) // 2] ^= 1
    Path(name).write_bytes(bytes(content))


def flipped_before_a_later_run(name, monkeypatch):
    flipped(name, monkeypatch)
    write_manifest(SUBJECT.plan, OPTIONS)


def forged(content, monkeypatch):
    """Another file with its checksum and its entry."""
    write_text(content, NAMES[2])
    write_manifest(SUBJECT.plan, OPTIONS)


def taken_out(name, _):
    rewrite(lambda entries: entries.pop(f"../{name}".replace("../results/", "")))


def foreign(name, _):
    rewrite(lambda entries: entries.update({name: entries["tables/a.csv"]}))


def lost(name, _):
    Path(name).unlink()


def lost_and_unlisted(name, monkeypatch):
    lost(name, monkeypatch)
    write_manifest(SUBJECT.plan, OPTIONS)
    assert "paper/m.tex" not in read_manifest("results").files


def broken_maker(_, monkeypatch):
    monkeypatch.setattr(SUBJECT.plan, "fixed", {"paper": [job_of(BROKEN)]})


def no_manifest(content, _):
    write_text(content, "results/manifest.json")
    with pytest.raises(StorageError, match=r"manifest\.json: "):
        read_manifest("results")


STUDY = "./reproduce --configfile 'my study.yaml'"
AGAIN = f"run {STUDY}\n"
RUN = f"; every successful run writes it, run {STUDY}\n"
# Change, changed file, text of the report.
FAULTS = (
    (flipped, NAMES, f"NAME: damaged (its checksum differs); {AGAIN}3 of 4 files"),
    (flipped_before_a_later_run, NAMES[:1], "NAME: damaged"),
    (forged, ("x\n3.0\n2.6\n", "", "a picture"), f"{NAMES[2]}: not made from its inputs; {AGAIN}"),
    (taken_out, NAMES, f"NAME: not in the manifest; {AGAIN}"),
    (foreign, ("../../secret", "/etc/hostname", "../paper/main.tex", "notes.md"),
     ": not a file of this study\n"),
    (lost, NAMES, f"NAME: not there; {AGAIN}"),
    (lost_and_unlisted, NAMES[3:], f"NAME: not there; {AGAIN}"),
    (lost, ("results/manifest.json",), f"NAME: no such file{RUN}"),
    (lost, ("results/paper/.m.tex.blake2b",), f"{NAMES[3]}: damaged"),
    (broken_maker, NAMES[2:3], f"NAME: not made from its inputs; {AGAIN}"),
    (no_manifest, ("{", '{"format": 1}', '{"format": 2, "file": {}}'), RUN),
)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "name", "said"), [(c, name, said) for c, names, said in FAULTS for name in names]
)
def test_a_faulty_file_is_noticed_and_the_command_is_named(change, name, said, monkeypatch, capsys):
    change(name, monkeypatch)
    status = verify_files(SUBJECT)
    found = capsys.readouterr().out
    assert said.replace("NAME", name) in found
    missing = ": not there" in found or ": no such file" in found
    assert status is (Status.MISSING if missing else Status.DIFFERS)


def test_outputs_with_the_same_name_are_distinguished():
    """A page of the article has the name of a table's page in another folder."""
    paths = {"page": "results/article/a.html", "other": "results/article/tables/a.html"}
    job = Job(PAGES, {}, {}, paths, {}, "", "")
    job.make(paths)
    assert differing(job) == []
    write_text("another", paths["other"])
    assert differing(job) == [paths["other"]]


def test_every_artifact_that_takes_seconds_is_made_again(subject, monkeypatch):
    monkeypatch.chdir(ROOT)
    plan, folders = subject.plan, subject.folders
    known = [*declared().values(), *declarations().values(), paper_inputs, live_page, article]
    wanted = [place.at(folders.results) for one in known for place in one.writes.values()]
    assert sorted(plan.made) == sorted([*wanted, *folders.documents.values()])
