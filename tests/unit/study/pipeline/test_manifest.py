"""Which files on the disk belong to a study."""

from pathlib import Path

import pytest

from pdrom.core.yamlfile import read_yaml
from places import ROOT
from study.artifact import paths
from study.pipeline.folders import Folders
from study.pipeline.manifest import study_files
from study.pipeline.plan import load_plan


@pytest.fixture(scope="module")
def plan():
    """Plan of the smallest study: one scene."""
    config = {**read_yaml(ROOT / "config" / "default.yaml"), "scenes": ["bend_fall"]}
    return load_plan(config, ROOT, quiet=True)


def test_files_of_the_study_and_what_was_asked_for_beside_them(plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = [
        paths.TABLE.at("results", name="claims"),
        paths.FIGURE_PICTURE.at("results", name="ladder"),
        paths.TRAIN.at("results", scene="bend_fall"),
        paths.PAPER_INPUT.at("results", name="macros.tex"),
        "results/machine.json",
        "paper/main.pdf",
        "paper/supplement.pdf",
    ]
    asked_for = [paths.TRAIN.at("results", scene="spring_oop")]
    others = [
        paths.TRAIN.at("results", scene="no_such_scene"),
        paths.RERUNS.at("results", scene="bend_fall", group="bending", method="no-such-method"),
        paths.TRAIN.at("results/studies/tiny", scene="bend_fall"),
        "results/logs/fom/spring_oop.log",
        "results/tables/old.csv",
        "results/notes.txt",
    ]
    for name in (*own, *asked_for, *others):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()
    assert sorted(study_files(plan, Folders())) == sorted([*own, *asked_for])
