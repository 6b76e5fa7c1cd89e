"""Expected tables: contents, compression, and conditions of an update."""

import pandas as pd
import pytest

from pdrom.core.errors import ConfigurationError, StorageError
from places import ROOT
from study.tables import declared
from study.tables.kit.declaration import TOLERANCES
from study.verification import compare
from study.verification.command import update
from study.verification.compare import read_references, write_reference
from study.verification.subject import Subject

TABLE = declared()["reduced_reruns"]


@pytest.fixture
def frame(tracked):
    return tracked[TABLE.name].head(20)


def test_a_reference_is_read_without_times_and_a_large_one_is_compressed(
    frame, tmp_path, monkeypatch
):
    read = []
    for end in (".csv", ".csv.xz"):
        write_reference(TABLE, frame, tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == [f"reduced_reruns{end}"]
        read.append(read_references(tmp_path)[TABLE.name])
        monkeypatch.setattr(compare, "PACKED_BYTES", 100)
    lost = dict.fromkeys(set(TABLE.column_names) - set(read[0].columns))
    for reference in read:
        pd.testing.assert_frame_equal(reference.frame, TABLE.checked(frame.assign(**lost)))
        assert set(reference.columns) == {c.name for c in TABLE.columns if c.quantity in TOLERANCES}
        assert set(reference.columns) & {"relative_error", "speedup"} == {"relative_error"}


def test_a_damaged_reference_is_named(tmp_path):
    (tmp_path / "reduced_reruns.csv.xz").write_bytes(b"no archive")
    with pytest.raises(StorageError, match=r"reduced_reruns\.csv\.xz"):
        read_references(tmp_path)


@pytest.fixture
def subject(tmp_path, monkeypatch):
    """A configuration without results."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").symlink_to(ROOT / "config")
    return Subject.of(["config/tiny.yaml"], [])


@pytest.mark.parametrize("reason", ["", "  \n"])
def test_references_are_not_updated_without_a_reason(subject, reason):
    with pytest.raises(ConfigurationError, match="a reason"):
        update(subject, reason)


@pytest.mark.parametrize("content", [None, "scene\n"])
def test_references_are_not_updated_from_missing_or_damaged_tables(subject, tmp_path, content):
    folder = tmp_path / "results" / "studies" / "tiny" / "tables"
    folder.mkdir(parents=True)
    if content:
        (folder / f"{min(declared())}.csv").write_text(content)
    with pytest.raises(StorageError, match="missing or damaged"):
        update(subject, "a reason")
    assert not (tmp_path / "results" / "reference").exists()
