"""The record of the winners on large meshes, and the table that reads it."""

from pathlib import Path

import pandas as pd

from pdrom.core.store import write_table
from pdrom.core.yamlfile import read_yaml
from places import ROOT
from study.pipeline.tracked import LARGE, recorded_meshes
from study.tables.large_meshes import RECORDED, large_meshes
from study.tables.winners import winners


def test_a_record_names_machine_and_day_and_changes_no_number(tmp_path: Path) -> None:
    made = winners.checked(
        pd.DataFrame(
            {
                "scene": ["s"],
                "vertices": [9],
                "reference": ["implicit"],
                "limit": [0.1],
                "method": ["newton"],
                "ms_per_frame": [0.1 + 0.2],
            }
        ).reindex(columns=winners.column_names)
    )
    write_table(made, tmp_path / "winners.csv")
    recorded = recorded_meshes(tmp_path / "winners.csv", "a processor")
    recorded.to_csv(tmp_path / "kept.csv", index=False)
    table = large_meshes.checked(large_meshes(tmp_path / "kept.csv"))
    assert table.processor.tolist() == ["a processor"]
    assert len(table.date[0].split("-")) == 3
    written = pd.read_csv(tmp_path / "winners.csv")
    assert table.ms_per_frame[0] == written.ms_per_frame[0]
    assert not large_meshes.timing_columns


def test_the_kept_record_is_what_the_study_asks_for() -> None:
    table = large_meshes.checked(large_meshes(ROOT / RECORDED))
    side = read_yaml(ROOT / LARGE)["alternatives"]["scenes"]["spring_oop"]
    meshes = table[table.scene == "spring_oop"].vertices.unique()
    assert meshes.tolist() == [round(400 * factor**2) for factor in side]
    assert table.groupby(["vertices", "reference", "limit"]).size().max() == 1
