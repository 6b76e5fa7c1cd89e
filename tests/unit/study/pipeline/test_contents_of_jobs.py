"""A job depends on what is in a mesh file, and on no title: what prints one alone is made again."""

from pathlib import Path

import pytest

from bad_input.project import MESH, SCENE, SQUARE, STUDY, Replace, load_project, make_project
from study.experiments.fom import mesh
from study.experiments.subspaces import online
from study.experiments.timing import scaling
from study.pipeline.contents import labels_of

# with a page of models, which prints titles
LIVE = "live: {scenes: [small]}\nsubspace: {scenes: [small], sizes: [2]}\n"


def changed(root: Path, old: str, new: str) -> set[str]:
    """Names of what is made again when one text of the scene's file is another one."""

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


def test_an_edited_title_plans_only_what_prints_it(tmp_path: Path) -> None:
    root = make_project(tmp_path, {})
    (root / STUDY).write_text((root / STUDY).read_text() + LIVE)
    assert changed(root, "title: A small sheet", "title: Another one") == {"live"}


def test_an_edited_weight_plans_the_simulation(tmp_path: Path) -> None:
    root = make_project(tmp_path, {})
    found = changed(root, "weight: 1.0e+5", "weight: 2.0e+5")
    assert {"fom", "timing", "sensitivity"} <= found
    assert "mesh" not in found


USED = Replace("{kind: cloth, rows: 5, columns: 4, plane: xz}", f"{{kind: file, path: {MESH}}}")


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
