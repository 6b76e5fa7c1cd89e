"""A job that reads a mesh file depends on what is in it."""

import re
from pathlib import Path

import pytest

from bad_input.project import MESH, SCENE, SQUARE, STUDY, Replace, load_project, make_project
from places import ROOT

USED = Replace("{kind: cloth, rows: 5, columns: 4, plane: xz}", f"{{kind: file, path: {MESH}}}")


@pytest.mark.parametrize("section", ["", "online: {scenes: [small]}\n"])
def test_an_edited_mesh_has_another_checksum(tmp_path: Path, section: str) -> None:
    root = make_project(tmp_path, {SCENE: USED})
    (root / STUDY).write_text((root / STUDY).read_text() + section)
    plan = load_project(root)
    before = plan.mesh_content("small")
    assert before == plan.mesh_content("small")
    (root / MESH).write_text(SQUARE.replace("v 1 0 1", "v 1 0 2"))
    assert plan.mesh_content("small") != before


def test_rules_that_read_meshes_themselves_depend_on_the_content() -> None:
    """A stage that is given the project's folder builds its mesh there."""
    rules = [
        rule
        for path in sorted((ROOT / "workflow" / "rules").glob("*.smk"))
        for rule in re.split(r"^rule ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        if "root=" in rule and "scene=" in rule
    ]
    assert len(rules) >= 2
    assert [rule.split(":")[0] for rule in rules if "content=" not in rule] == []
