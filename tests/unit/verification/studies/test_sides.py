"""Which study a word means, and which of its results count."""

from pathlib import Path

import pytest

from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import TABLE
from pdrom.core.store import write_table
from pdrom.verification.studies.sides import Side, place_of


def test_a_study_is_a_folder_an_archive_or_a_configuration(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results" / "studies" / "tiny").mkdir(parents=True)
    (tmp_path / "x.tar.gz").write_bytes(b"")
    (tmp_path / "mine.yaml").write_text("study: tiny\n")
    tiny = Path("results/studies/tiny")
    given = {
        "default": Path("results"),
        "tiny": tiny,
        "mine.yaml": tiny,
        "results": Path("results"),
    }
    for word, place in (given | {"x.tar.gz": Path("x.tar.gz")}).items():
        assert place_of(word) == place
    with pytest.raises(ConfigurationError, match=r"tinny: no .* did you mean 'tiny'\?"):
        place_of("tinny")


def test_a_table_made_after_the_manifest_counts(study, frames, tmp_path):
    folder = study("a")
    newer = frames["ladder"].head(3)
    write_table(newer, TABLE.at(str(folder), name="ladder"))
    write_table(newer, TABLE.at(str(folder), name="noise"))
    side = Side.read(folder, tmp_path)
    assert len(side.tables["ladder"]) == len(side.tables["noise"]) == 3
    assert side.facts["configuration"] == "the full study"
    assert side.facts["libraries"] == "numpy 2.4"
