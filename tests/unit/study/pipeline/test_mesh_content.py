"""A job that reads a mesh file depends on what is in it."""

from pathlib import Path

import pytest

from bad_input.project import MESH, SCENE, SQUARE, STUDY, Replace, load_project, make_project
from study.experiments.fom import mesh
from study.experiments.scaling import scaling
from study.experiments.subspaces import online

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
