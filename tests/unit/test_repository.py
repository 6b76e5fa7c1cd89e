"""What git tracks: text and a few pictures, nothing large, nothing binary by accident."""

import json
import subprocess
from pathlib import Path

import pytest

from pdrom.core.yamlfile import read_yaml
from pdrom.pipeline.tables import all_tables
from pdrom.report.codecheck import FILE, codecheck
from places import ROOT

LARGEST = 300_000
# Binary files that are meant: pictures of the pages for readers, compressed tables.
BINARY = ("docs/*.png", "results/reference/tables/*.xz", "results/reference/studies/*/tables/*.xz")


def tracked(*options: str) -> list[Path]:
    """Files of the index, also new ones; the test is left out where there is no git."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", *options], cwd=ROOT, capture_output=True, check=False
    )
    if listed.returncode:
        pytest.skip("no clone of the repository")
    names = [name for name in listed.stdout.decode().split("\0") if name]
    return [ROOT / name for name in names if (ROOT / name).is_file()]


def offends(path: Path) -> bool:
    """Whether a file is too large, or binary and not meant to be."""
    inside = path.relative_to(ROOT)
    binary = b"\0" in path.read_bytes()[:8000]
    return path.stat().st_size > LARGEST or (
        binary and not any(inside.match(pattern) for pattern in BINARY)
    )


def test_no_large_or_binary_file_is_tracked_or_about_to_be():
    files = tracked("--cached", "--others", "--exclude-standard")
    assert len(files) > 500
    assert [str(path.relative_to(ROOT)) for path in files if offends(path)] == []


def test_a_wheel_and_a_large_table_would_be_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    contents = {
        "a.whl": b"PK\3\4\0",
        "t.csv": b"1,2\n" * LARGEST,
        "x.py": b"1\n",
        "docs/a.png": b"\0",
    }
    for name, content in contents.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    assert [name for name in contents if offends(tmp_path / name)] == ["a.whl", "t.csv"]


def test_the_manifest_for_codecheckers_is_that_of_the_declarations(monkeypatch):
    """Written anew by: .venv/bin/python -m pdrom.pipeline.tables"""
    monkeypatch.chdir(ROOT)
    assert codecheck(all_tables().values()) == FILE.read_text("utf-8")
    content = read_yaml(FILE)
    assert {"version", "manifest", "paper", "codechecker", "report"} <= set(content)
    assert all(set(entry) == {"file", "comment"} for entry in content["manifest"])


def test_the_record_for_zenodo_is_that_of_the_citation():
    citation = read_yaml(ROOT / "CITATION.cff")
    record = json.loads((ROOT / ".zenodo.json").read_text("utf-8"))
    for key in ("title", "version", "license", "keywords"):
        assert record[key] == citation[key]
    assert record["creators"] == citation["authors"]
