"""A job that reads a mesh file depends on what is in it."""

from pathlib import Path

import pytest

from bad_input.project import MESH, SCENE, SQUARE, STUDY, Replace, load_project, make_project
from pdrom.experiments.mesh import EXPERIMENT as MESHES
from pdrom.experiments.online import EXPERIMENT as ONLINE
from pdrom.experiments.scaling import EXPERIMENT as SCALING

USED = Replace("{kind: cloth, rows: 5, columns: 4, plane: xz}", f"{{kind: file, path: {MESH}}}")


@pytest.mark.parametrize("experiment", [MESHES, ONLINE, SCALING], ids=lambda e: e.name)
def test_an_edited_mesh_has_another_checksum(tmp_path: Path, experiment) -> None:
    root = make_project(tmp_path, {SCENE: USED})
    (root / STUDY).write_text((root / STUDY).read_text() + "online: {scenes: [small]}\n")
    plan = load_project(root)
    content = plan.jobs.params(experiment)["content"]
    job = {"scene": "small", "mesh": plan.study.mesh_of("small"), "factor": "1"}
    before = content(job)
    assert before == content(dict(job))
    (root / MESH).write_text(SQUARE.replace("v 1 0 1", "v 1 0 2"))
    assert content(job) != before
