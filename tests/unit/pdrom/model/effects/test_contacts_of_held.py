"""Fixed vertices have infinite mass: no contact moves them. The log names impossible contacts."""

import logging

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs import trajectory
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.training import make_columns

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "lift": 1.0}
BASE = ({"effect": "gravity"}, {"effect": "strain", "weight": 1e4})
PINS = {"effect": "pins", "select": "bottom", "until": 12}
# each contains the lowest row of the sheet, at y = 0.6
OBSTACLES = {
    "floor": {"effect": "floor", "height": 0.7},
    "plane": {"effect": "plane", "point": [0, 0.7, 0], "normal": [0.1, 1, 0], "friction": 0.5},
    "sphere": {"effect": "sphere", "centre": [0, 0.0, 0], "radius": 0.9},
    "box": {"effect": "box", "lower": [-2, 0, -1], "upper": [2, 0.7, 1]},
}
FLOOR = OBSTACLES["floor"]


def warnings_of(scene, caplog) -> list[str]:
    with caplog.at_level(logging.WARNING, logger="pdrom"):
        scene.log_holds()
    return [record.getMessage() for record in caplog.records]


@pytest.mark.parametrize("name", OBSTACLES)
def test_pins_inside_an_obstacle_stay_fixed_are_named_and_are_released_at_rest(name, caplog):
    scene = make_scene(*BASE, PINS, OBSTACLES[name], mesh=SHEET)
    held, rest = scene.boundaries[0].vertices, scene.mesh.points
    (message,) = warnings_of(scene, caplog)
    assert f"6 held vertices have targets inside '{name}'" in message
    assert message.endswith(", ".join(str(i) for i in held))
    loop, state = scene.stepper(), scene.initial_state()
    for frame in range(12):
        state, _ = loop.step(state, frame)
        assert np.array_equal(state.positions[held], rest[held])
        assert not state.velocities[held].any()
    state, _ = loop.step(state, 12)
    assert (state.positions[held] != rest[held]).any()
    model = SubspaceModel(make_columns([scene], trajectory(scene)[1:], 4))
    loop, state = model.loop(scene)
    for frame in range(12):
        state, _ = loop.step(state, frame)
        assert model.positions(state.positions)[held] == pytest.approx(rest[held], abs=1e-12)
        assert model.positions(state.velocities)[held] == pytest.approx(0.0, abs=1e-10)


def test_a_collision_moves_only_free_vertices(rng):
    """In a close pair with one fixed vertex, the other vertex moves by the complete distance."""
    collision = {"effect": "self_collision", "thickness": 0.3}
    scene = make_scene(*BASE, PINS, collision, mesh=SHEET)
    (contact,), held = scene.contacts, scene.boundaries[0].vertices
    before = scene.mesh.points + 0.05 * rng.standard_normal(scene.mesh.points.shape)
    positions = before.copy()
    near = held + 2
    positions[near] = positions[held] + [0.0, 0.02, 0.01]
    ended = positions.copy()
    contact.apply(ended, before, held)
    assert np.array_equal(ended[held], positions[held])
    gaps = np.linalg.norm(ended[near] - ended[held], axis=1)
    assert gaps.min() >= 0.9 * 0.3
    contact.correct(positions, before)
    assert not np.array_equal(ended[held], positions[held])


def test_targets_are_named_only_if_something_obstructs_them_later(caplog):
    for effects in (
        [PINS, {**FLOOR, "height": 0.6}],
        [PINS, {**OBSTACLES["plane"], "point": [0, 0.6, 0], "normal": [0, 0.3, 0]}],
        [{**PINS, "start": 2}, FLOOR],  # vertices that were pushed out before
        [PINS, {"effect": "self_collision", "thickness": 0.3}],
    ):
        assert warnings_of(make_scene(*BASE, *effects, mesh=SHEET), caplog) == []
    down = {"effect": "translate", "select": "bottom", "offset": [0, -0.3, 0], "over": 9}
    obstructed = {**down, "start": 3}, {**FLOOR, "height": 0.5}
    (message,) = warnings_of(make_scene(*BASE, *obstructed, mesh=SHEET), caplog)
    assert "6 held vertices have targets inside 'floor'" in message


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
def test_free_vertices_inside_an_obstacle_give_a_warning(caplog, contact, count, far):
    """The sheet hangs from y = 2.375 to y = 1.625; its left top corner is held."""
    pins = {"effect": "pins", "select": {"kind": "nearest", "point": [-1, 2.5, 0], "count": 1}}
    sheet = {"kind": "cloth", "rows": 5, "columns": 4}
    make_scene(pins, contact, {"effect": "spring", "weight": 1.0}, mesh=sheet).log_contacts()
    messages = [message for message in caplog.messages if "free" in message]
    assert len(messages) == (count > 0)
    for part in (f"'{contact['effect']}'", f"{count} of 19 free", f"by up to {far:.3g} m"):
        assert all(part in message for message in messages)
