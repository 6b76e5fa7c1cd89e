"""``./reproduce compare A B``: exit codes, the page, one line for bad input, nothing touched."""

import gzip
import hashlib
import io
import json
import tarfile

import pytest

from pdrom.verification.bundle import Member, write_archive
from pdrom.verification.status import ended
from pdrom.verification.studies.__main__ import FAULTY, compare

INSIDE = "published/results"


def run(capsys, *arguments):
    """Exit code and what was said."""
    status = ended(lambda: compare([*map(str, arguments)]), FAULTY)
    said = capsys.readouterr()
    return status, said.out + said.err


def state(folder):
    """Bytes and dates of all files and folders."""
    return {
        path: (
            path.stat().st_mtime_ns,
            path.is_file() and hashlib.sha256(path.read_bytes()).digest(),
        )
        for path in [folder, *folder.rglob("*")]
    }


def archive(folder, target):
    """The results of a folder as ``./reproduce bundle`` packs them."""
    files = [p for p in folder.rglob("*") if p.is_file() and p.name[0] != "."]
    members = [Member(f"{INSIDE}/{p.relative_to(folder)}", p.read_bytes()) for p in files]
    write_archive([*members, Member("reproduce", b"#!/bin/sh\n", True)], target)
    return target


def test_equal_studies_agree_and_are_left_alone(study, tmp_path, capsys):
    a, b, page = study("a"), study("b"), tmp_path / "page.html"
    before = state(a), state(b)
    status, said = run(capsys, a, b, "--page", page)
    assert (status, said) == (0, f"Nothing differs beyond tolerance.\npage: {page}\n")
    first = page.read_bytes()
    assert run(capsys, a, b, "--page", page)[0] == 0
    assert page.read_bytes() == first
    assert (state(a), state(b)) == before


def test_a_difference_is_named_and_has_its_code(study, frames, tmp_path, capsys):
    runs = frames["reduced_reruns"]
    other = runs.assign(relative_error_within_horizon=2 * runs.relative_error_within_horizon)
    a, b = study("a"), study("b", {"reduced_reruns": other})
    status, said = run(capsys, a, b, "--page", tmp_path / "page.html")
    assert status == 1
    assert "table reduced_reruns: differs, scene " in said
    assert "table singular_values" not in said


def test_an_archive_is_as_good_as_its_folder(study, tmp_path, capsys):
    a = study("a")
    packed = archive(study("b"), tmp_path / "b.tar.gz")
    before = packed.read_bytes(), packed.stat().st_mtime_ns
    status, said = run(capsys, a, packed, "--page", tmp_path / "page.html")
    assert status == 0, said
    assert (packed.read_bytes(), packed.stat().st_mtime_ns) == before


def cut(folder, tmp_path):
    packed = archive(folder, tmp_path / "cut.tar.gz")
    packed.write_bytes(packed.read_bytes()[:-2000])
    return packed, "no archive of results, or cut off"


def with_junk(folder, tmp_path):
    packed = archive(folder, tmp_path / "junk.tar.gz")
    content = gzip.decompress(packed.read_bytes()).rstrip(b"\0")
    packed.write_bytes(gzip.compress(content + bytes(-len(content) % 512)) + b"junk")
    return packed, "no archive of results, or cut off"


def foreign(folder, tmp_path):
    (tmp_path / "photos").mkdir()
    return tmp_path / "photos", "manifest.json: no such file"


def other_manifest(folder, tmp_path):
    (folder / "manifest.json").write_text('{"name": "a web page"}')
    (folder / ".manifest.json.blake2b").unlink()
    return folder, "manifest.json: "


def edited(folder, tmp_path):
    table = folder / "tables" / "ladder.csv"
    table.write_text(table.read_text().replace("1", "2"))
    return folder, "tables/ladder.csv: damaged, or not the one"


def lost(folder, tmp_path):
    (folder / "tables" / "ladder.csv").unlink()
    return folder, "tables/ladder.csv: not there"


def damaged_record(folder, tmp_path):
    path = folder / "manifest.json"
    path.write_text(path.read_text() + " ")
    return folder, "manifest.json: damaged"


def no_tables(folder, tmp_path):
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / ".manifest.json.blake2b").unlink()
    (folder / "manifest.json").write_text(json.dumps(manifest | {"files": {}}))
    for path in (folder / "tables").iterdir():
        path.unlink()
    return folder, "its manifest lists no table"


def no_archive(folder, tmp_path):
    path = tmp_path / "text.tar.gz"
    path.write_text("words\n")
    return path, "no archive of results"


def unknown(folder, tmp_path):
    return "no_such_study", "no_such_study: no folder of results, archive"


def lost_from_the_archive(folder, tmp_path):
    (folder / "tables" / "ladder.csv").unlink()
    return archive(folder, tmp_path / "less.tar.gz"), "less.tar.gz/tables/ladder.csv: not there"


@pytest.mark.parametrize(
    "fault",
    [cut, with_junk, foreign, other_manifest, edited, lost, damaged_record, no_tables, no_archive,
     unknown, lost_from_the_archive],
)  # fmt: skip
def test_bad_input_ends_in_one_line(fault, study, tmp_path, capsys):
    a = study("a")
    b, message = fault(study("b"), tmp_path)
    before = state(tmp_path)
    page = tmp_path / "page.html"
    for pair in ((a, b), (b, a)):
        status, said = run(capsys, *pair, "--page", page)
        assert status == 2
        assert message in said
        assert said.startswith("pdrom: ")
        assert said.count("\n") == 1
    assert state(tmp_path) == before


def member(name, kind=tarfile.REGTYPE, link=""):
    entry = tarfile.TarInfo(name)
    entry.type, entry.linkname = kind, link
    return entry


@pytest.mark.parametrize(
    "entry",
    [
        member("pdrom/../../escaped.csv"),
        member("/escaped.csv"),
        member("pdrom/published/results/tables/a.csv", tarfile.SYMTYPE, "/escaped.csv"),
        member("pdrom/published/results/tables/a.csv", tarfile.LNKTYPE, "../escaped.csv"),
        member("pdrom/published/results/tables/a.csv", tarfile.CHRTYPE),
    ],
    ids=["up", "absolute", "symbolic link", "hard link", "device"],
)
def test_an_archive_that_leads_out_of_it_is_refused(entry, study, tmp_path, capsys):
    packed = tmp_path / "b.tar.gz"
    with tarfile.open(packed, "w:gz") as members:
        members.addfile(entry, io.BytesIO())
    a = study("a")
    before = state(tmp_path)
    status, said = run(capsys, a, packed, "--page", tmp_path / "page.html")
    assert status == 2
    assert f"b.tar.gz: '{entry.name}': a member that is no plain file inside it" in said
    assert state(tmp_path) == before


def test_the_same_study_and_a_page_in_a_study_are_refused(study, tmp_path, capsys):
    a, b = study("a"), study("b")
    (tmp_path / "link").symlink_to(a)
    before = state(tmp_path)
    for arguments, message in (
        ((a, tmp_path / "link"), "are the same study"),
        ((a, b, "--page", b / "page.html"), "of which nothing is changed"),
        ((a, b, "--page", tmp_path / "tables.csv"), "has to end in .html"),
        ((a, b, "--page", a / "machine.json" / "page.html"), "of which nothing is changed"),
    ):
        status, said = run(capsys, *arguments)
        assert (status, said.count("\n")) == (2, 1)
        assert message in said
    assert state(tmp_path) == before
