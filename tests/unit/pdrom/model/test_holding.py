"""What the log says about held vertices."""

import logging

import numpy as np
import pytest

from builders import LEFT
from pdrom.model.mesh.generators import cloth
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene, SceneConfig

SHEET = {"kind": "cloth", "rows": 5, "columns": 4}


def logged(caplog, mesh: Mesh, *effects: dict) -> list[tuple[str, str]]:
    """Levels and messages about the holds and contacts of a scene with ``effects``."""
    spring = {"effect": "spring", "weight": 1.0}
    config = {"name": "sheet", "title": "t", "mesh": SHEET, "frames": 4}
    scene = Scene.build(SceneConfig(**config, effects=[*effects, spring]), mesh)
    with caplog.at_level(logging.INFO, logger="pdrom"):
        scene.log_holds()
        scene.log_contacts()
    return [(record.levelname, record.getMessage()) for record in caplog.records]


def test_every_hold_is_counted(caplog):
    poke = {"effect": "poke", "count": 2, "avoid": ["left", [19]]}
    listed = {"effect": "translate", "select": [19], "offset": [0, 0, 1], "over": 2}
    assert logged(caplog, cloth(5, 4), LEFT, poke, listed) == [
        ("INFO", "scene 'sheet', effect 'pins': holds 4 of 20 vertices (select: left)"),
        ("INFO", "scene 'sheet', effect 'poke': holds 2 of 20 vertices"),
        ("INFO", "scene 'sheet', effect 'translate': holds 1 of 20 vertices"),
    ]


def test_a_side_of_one_vertex_is_a_warning(caplog):
    """An unstructured sheet: no two vertices lie on one line along y."""
    mesh = cloth(5, 4)
    moved = mesh.points + np.random.default_rng(1).uniform(-0.01, 0.01, mesh.points.shape)
    ((level, message),) = logged(caplog, Mesh(moved, mesh.triangles), LEFT)
    assert level == "WARNING"
    assert "effect 'pins': holds 1 of 20 vertices, fewer than 3 (select: left" in message


@pytest.mark.parametrize(
    ("contact", "count", "far"),
    [
        ({"effect": "floor", "height": 1.7}, 5, 0.075),
        ({"effect": "floor", "height": 1.5}, 0, 0.0),
        ({"effect": "plane", "point": [0, 2.25, 0], "normal": [0, -1, 0]}, 4, 0.125),
        ({"effect": "sphere", "centre": [0, 1.5, 0], "radius": 0.1}, 0, 0.0),
        ({"effect": "box", "lower": [-1, 1, -1], "upper": [1, 1.7, 1]}, 5, 0.075),
        ({"effect": "self_collision", "thickness": 0.3}, 0, 0.0),
    ],
)
def test_free_vertices_inside_an_obstacle_are_a_warning(caplog, contact, count, far):
    """The sheet hangs from y = 2.375 to y = 1.625; its left top corner is held."""
    pins = {"effect": "pins", "select": {"kind": "nearest", "point": [-1, 2.5, 0], "count": 1}}
    said = (
        f"scene 'sheet', effect '{contact['effect']}': {count} of 19 free vertices lie inside it "
        f"at rest and are moved by up to {far:.3g} m in the first frame"
    )
    logged(caplog, cloth(5, 4), pins, contact)
    assert [words for words in caplog.messages if "free" in words] == ([said] if count else [])
