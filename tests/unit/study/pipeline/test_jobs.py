"""Settings of jobs, changes that rerun them, and the files of a study."""

from dataclasses import replace
from pathlib import Path

import pytest

from bad_input.project import MESH, SCENE, SQUARE, STUDY, load_project, make_project, with_mesh
from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml
from places import CONFIG as CONFIG_FOLDER
from places import ROOT
from study.artifact import paths
from study.artifact.reads import Setting, TableOf
from study.experiments.fom import mesh
from study.experiments.subspaces import online
from study.experiments.timing import scaling
from study.figures.kit.declaration import declarations
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.study import Study, labels_of
from study.tables import declared

CONFIG = {"scenes": ["spring_oop", "strain_oop"], "methods": ["deim", "block-deim"]}


def plan(**changes) -> Plan:
    return Plan(Study(CONFIG | changes, ROOT), Folders("out"))


def test_every_table_finds_its_inputs_in_the_order_of_the_study():
    made = {job.artifact.name: job for job in plan().fixed["tables"]}
    for name, table in declared().items():
        assert made[name].inputs.keys() | made[name].settings.keys() == table.reads.keys()
        assert made[name].outputs == {"table": f"out/tables/{name}.csv"}
    assert made["sensitivity"].inputs == {
        "rows": ["out/sensitivity/spring_oop.csv", "out/sensitivity/strain_oop.csv"]
    }
    assert made["equal_error"].inputs["rows"] == "out/tables/alternatives.csv"
    assert made["online"].inputs["rows"] == []
    assert made["claims"].inputs["rules"] == "config/claims.yaml"


def test_a_study_of_other_scenes_plans_only_files_of_its_scenes():
    default = read_yaml(CONFIG_FOLDER / "default.yaml")
    own = Plan(Study(default | {"scenes": ["ball_shell", "torus_release"]}, ROOT), Folders("out"))
    own.check()
    places = [place for made in own.experiments.values() for place in made.writes.values()]
    known = [found[1] for path in own.own_files for found in paths.labels_in(path, "out", places)]
    assert {labels["scene"] for labels in known if "scene" in labels} == {
        "ball_shell",
        "torus_release",
    }
    jobs = [job for jobs in own.fixed.values() for job in jobs]
    assert {path for job in jobs for path in job.results} <= own.own_files
    assert not [path for job in jobs for path in job.files if "recorded" in path]
    named = {path.rpartition("/")[2].partition(".")[0] for path in own.own_files}
    about_others = {
        "alternatives", "equal_error", "frontier", "scaling", "ladder", "online", "speedups",
        "claims", "tab_claims", "cases", "live", "strain_runs", "noise",
    }  # fmt: skip
    assert about_others & named == set()
    assert {"spring_runs", "bar_runs", "error_against_gain", "payoff", "tab_reruns"} <= named
    # the full study, and a study that decides the claims on other scenes, have all files
    for changes in ({}, {"scenes": ["ball_shell"], "claim_sets": {"sound_scenes": ["ball_shell"]}}):
        whole = Plan(Study(default | changes, ROOT), Folders("out"))
        assert {*whole.tables, *whole.figures} == {*declared(), *declarations()}


def test_a_setting_is_a_parameter_only_of_jobs_that_read_it():
    before, after = plan(), plan(stability={"wrong": 0.3})
    tables = declared().values()
    changed = {t.name for t in tables if before.job(t).settings != after.job(t).settings}
    assert changed == {"stability"}


@pytest.mark.parametrize(
    ("read", "message"),
    [
        (Setting("stability.wrogn"), "'stability.wrogn'.*wrong"),
        (TableOf("sensitivty"), "'sensitivty'.*sensitivity"),
    ],
)
def test_a_missing_scene_or_method_is_named(read, message):
    asked = plan()
    asked.tables = {"payoff": replace(declared()["payoff"], reads={"reruns": read})}
    with pytest.raises(ConfigurationError, match=message):
        asked.check()


# with a page of models, which prints titles
LIVE = "live: {scenes: [small]}\nsubspace: {scenes: [small], sizes: [2]}\n"


def changed(root: Path, old: str, new: str) -> set[str]:
    """Names of the files that are made again if a text of the scene's file changes."""

    def jobs() -> dict[tuple, tuple]:
        plan = load_project(root)
        made = {
            (name, *labels.values()): plan.job(experiment, labels)
            for name, experiment in plan.experiments.items()
            for labels in labels_of(plan.study, next(iter(experiment.writes.values())))
        }
        made |= {(job.artifact.name,): job for jobs in plan.fixed.values() for job in jobs}
        return {key: (job.inputs, job.settings, job.content, job.code) for key, job in made.items()}

    before, scene = jobs(), root / SCENE
    text = scene.read_text()
    assert old in text
    scene.write_text(text.replace(old, new))
    after = jobs()
    assert before.keys() == after.keys()
    return {key[0] for key in before if before[key] != after[key]}


def test_an_edit_of_a_scene_plans_the_jobs_that_read_or_print_it(tmp_path):
    """A title reruns only the page of models, a weight the simulation."""
    root = make_project(tmp_path, {})
    (root / STUDY).write_text((root / STUDY).read_text() + LIVE)
    assert changed(root, "title: A small sheet", "title: Another one") == {"live"}
    found = changed(root, "weight: 1.0e+5", "weight: 2.0e+5")
    assert {"fom", "timing", "sensitivity"} <= found
    assert "mesh" not in found


USED = with_mesh(f"{{kind: file, path: {MESH}}}")


@pytest.mark.parametrize("experiment", [mesh, online, scaling], ids=lambda e: e.name)
def test_an_edited_mesh_has_another_checksum(tmp_path: Path, experiment) -> None:
    root = make_project(tmp_path, {SCENE: USED})
    (root / STUDY).write_text((root / STUDY).read_text() + "online: {scenes: [small]}\n")

    def content() -> str:
        plan = load_project(root)
        labels = {"scene": "small", "mesh": plan.study.mesh_of("small"), "factor": "1"}
        return plan.job(experiment, labels).content

    before = content()
    assert before == content()
    (root / "config" / "scenes" / MESH).write_text(SQUARE.replace("v 1 0 1", "v 1 0 2"))
    assert content() != before
