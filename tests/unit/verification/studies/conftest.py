"""Small studies to be compared: tables of the tiny study, a picture, a record, a manifest."""

import hashlib
import json

import pytest
from PIL import Image

from pdrom.core.paths import TABLE
from pdrom.core.provenance import made_by
from pdrom.core.store import atomic_path, provenance_of, write_table, write_text
from pdrom.pipeline.manifest import Entry, Manifest
from pdrom.tables import declared

CHOSEN = ("claims", "reduced_reruns", "singular_values", "ladder", "local_share")
ROWS = 40
CODE = "2" * 64


def timed(table, frame):
    """A table with a number in place of times, which references do not have."""
    columns = [c.name for c in table.columns if c.timed and c.kind == "number"]
    return frame.assign(**dict.fromkeys(columns, 2.0))


@pytest.fixture
def frames(tracked):
    """Some tables of the tiny study by name."""
    found = {name: timed(declared()[name], tracked[name].head(ROWS)) for name in CHOSEN}
    words = dict.fromkeys(("verdict", "verdict_beyond"), "holds")
    return found | {"claims": found["claims"].assign(**words)}


def write_study(folder, tables, code=CODE, grey=100, raw="1\n"):
    """A folder of results with these tables, one figure of runs and one of a table.

    Parameters
    ----------
    code : fingerprint of the code that made it
    grey : of the figures
    raw : result that the figure of runs is drawn from
    """
    with made_by("test", {}, code):
        for name, frame in tables.items():
            write_table(frame, TABLE.at(str(folder), name=name))
        for figure in ("ladder", "sensitivity_floor"):
            with atomic_path(folder / "figures" / f"{figure}.png") as path:
                Image.new("RGB", (30, 20), (grey, grey, grey)).save(path)
        write_text(raw, folder / "sensitivity" / "bar_release.csv")
        record = {"cpu": "a <processor>", "cores": 2, "libraries": {"numpy": "2.4"}, "kernels": []}
        write_text(json.dumps(record), folder / "machine.json")
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name[0] != "."]
    files = {str(path.relative_to(folder)): entry(path) for path in paths}
    manifest = Manifest(options=(), environments={}, files=files)
    write_text(manifest.model_dump_json(exclude_none=True), folder / "manifest.json")
    return folder


def entry(path):
    """What a manifest says about a file."""
    made, content = provenance_of(path), path.read_bytes()
    return Entry(
        bytes=len(content),
        blake2b=hashlib.blake2b(content).hexdigest(),
        sha256=hashlib.sha256(content).hexdigest(),
        configuration_sha256=made["configuration_sha256"],
        code_sha256=made["code_sha256"],
    )


@pytest.fixture
def study(tmp_path, frames, monkeypatch):
    """Write a study: its name, what replaces its tables, and options of `write_study`."""

    monkeypatch.setattr("os.fsync", lambda descriptor: None)

    def write(name, replaced=None, **options):
        return write_study(tmp_path / name, frames | (replaced or {}), **options)

    return write
