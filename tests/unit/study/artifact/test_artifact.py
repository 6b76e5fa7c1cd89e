"""Artifacts: declarations are checked, settings typed, jobs run from plain data."""

from pathlib import Path
from pkgutil import resolve_name
from types import SimpleNamespace

import pandas as pd
import pytest
from pydantic import ValidationError

from pdrom.core.store import checksum_path, read_table, write_table
from pdrom.core.yamlfile import ConfigModel
from study.artifact import reads
from study.artifact.artifact import declared_in, make, modules_in
from study.artifact.paths import File, Place
from study.experiments.kit.base import Experiment, experiment, experiments

SCENE = Place("a/{scene}.csv")


class Section(ConfigModel):
    """Keys of a section that the function reads."""

    factor: float

    @property
    def modules(self) -> list[str]:
        """A module that the settings name."""
        return ["pdrom.model.effects.forces"]


class Whole(Section):
    others: tuple[str, ...] = ("b",)


@experiment(
    "Rows of {scene} times a factor",
    reads={"table": SCENE, "section": reads.Setting("section")},
    writes={"out": Place("c/{scene}.csv")},
)
def multiplied(table: File, section: Section, out: File) -> None:
    write_table(read_table(table.path) * section.factor, out.path)


# A stub of a study; test_jobs.py tests the files of a real one.
SETTINGS = {"section": Whole(factor=2.0), "factor": 3.0}
STUDY = SimpleNamespace(value=lambda key, labels: SETTINGS[key])


def test_a_job_runs_from_plain_data_and_records_its_provenance(tmp_path):
    source, out = str(tmp_path / "a" / "s.csv"), str(tmp_path / "c" / "s.csv")
    write_table(pd.DataFrame({"x": [1.0, 2.0]}), source)
    settings = multiplied.settings(STUDY, {"scene": "s"})
    make(
        multiplied.address, settings=multiplied.plain(settings), labels={"scene": "s"},
        code="c0de", inputs={"table": source}, outputs={"out": out},
    )  # fmt: skip
    assert read_table(out).x.tolist() == [2.0, 4.0]
    assert "multiplied" in checksum_path(Path(out)).read_text()


def test_a_job_depends_only_on_the_keys_of_a_section_that_its_function_reads():
    settings = multiplied.settings(STUDY, {"scene": "s"})
    assert multiplied.plain(settings) == {"section": {"factor": 2.0}}
    assert list(modules_in(settings)) == ["pdrom.model.effects.forces"]


@pytest.mark.parametrize("settings", [{"section": {"factor": "much"}}, {"section": {"other": 1}}])
def test_faulty_settings_are_refused(settings, tmp_path):
    write_table(pd.DataFrame({"x": [1.0]}), tmp_path / "a" / "s.csv")
    inputs = {"table": str(tmp_path / "a" / "s.csv")}
    with pytest.raises(ValidationError):
        multiplied.perform(settings, inputs, {"out": str(tmp_path / "c" / "s.csv")})


def test_artifacts_are_found_and_loaded_by_their_address():
    found = experiments()
    assert list(found) == sorted(found)
    assert {"fom", "pod", "reruns", "subspaces"} <= set(found)
    for made in found.values():
        assert resolve_name(made.address) is made
        assert set(made.types) | set(made.files) == set(made.reads)
    assert declared_in("pdrom.core", Experiment) == {}
