"""Self-collision: no pair ends closer than allowed, momentum is conserved, nothing else moves."""

import logging

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.distance import pdist

from builders import GRAVITY, make_scene
from pdrom.core.errors import NotReducibleError
from pdrom.reduction.subspace.space import ReducedSpace
from pdrom.reduction.subspace.training import make_columns
from strategies import SEEDS
from study.experiments.hard_cases.catalogue import start_of

GROUPS = ({"effect": "spring", "weight": 1e4}, {"effect": "strain", "weight": 1e3})
SHEET = {"kind": "cloth", "rows": 12, "columns": 12, "plane": "xz", "lift": 0.1}
THICKNESS = 0.08


def sheet(*effects, thickness=THICKNESS, mesh=SHEET, **settings):
    collision = {"effect": "self_collision", "thickness": thickness}
    return make_scene(*GROUPS, *effects, collision, mesh=mesh, **settings)


def closest(scene, positions):
    """Least distance over the thickness, of pairs whose distance at rest exceeds the thickness."""
    apart = pdist(scene.mesh.points) > THICKNESS
    return pdist(positions)[apart].min() / THICKNESS


@pytest.mark.parametrize(
    "start",
    [{"folded": True}, {"folded": True, "noise": 1e-3}, {"scrambled": 1.0}, {"mapped": [0, 0, 0]}],
)
def test_no_pair_ends_closer_than_90_percent_of_the_thickness(start):
    """A sheet falls on the floor and folds; vertices coincide at the start."""
    scene = sheet(GRAVITY, {"effect": "floor"})
    loop, state = scene.stepper(), start_of(scene, **start)
    assert closest(scene, state.positions) < 0.5
    for frame in range(40):
        state, _ = loop.step(state, frame)
    assert closest(scene, state.positions) >= 0.9


@given(seed=SEEDS)
def test_a_collision_keeps_the_centre_of_mass(seed):
    """Vertices of different mass move in proportion to their inverse masses."""
    rng = np.random.default_rng(seed)
    scene = sheet(masses=[{"select": "left", "vertex_mass": 500.0}])
    (contact,) = scene.contacts
    before = scene.mesh.points + 0.1 * rng.standard_normal(scene.mesh.points.shape)
    positions = before + 0.02 * rng.standard_normal(before.shape)
    ended = positions.copy()
    contact.correct(ended, before)
    moved = scene.masses @ (ended - positions)
    assert np.abs(moved).max() < 1e-10 * scene.masses.sum()
    assert closest(scene, ended) >= 0.9


def test_a_pair_that_passed_through_each_other_is_put_back():
    """Two layers that are 10 % of the thickness beyond each other end in their old order."""
    scene = sheet()
    (contact,) = scene.contacts
    before = scene.mesh.points.copy()
    upper = before[:, 0] > 0.0
    before[upper, 0] -= 0.5
    before[upper, 1] += 0.09
    after = before.copy()
    after[upper, 1] -= 0.1
    contact.correct(after, before)
    assert after[upper, 1].min() > after[~upper, 1].max()


def test_the_log_names_a_thickness_that_is_too_small_and_one_that_suffices(caplog):
    with caplog.at_level(logging.WARNING):
        sheet().log_contacts()
        assert caplog.messages == []
        sheet(thickness=0.05).log_contacts()
        sheet(thickness=0.075).log_contacts()
    (message,) = caplog.messages
    said = "with thickness 0.05 a vertex can pass between others; at least 0.075 is needed"
    assert message.endswith(f"effect 'self_collision': {said}")


def test_a_position_subspace_refuses_self_collision():
    scene = sheet()
    columns = make_columns([scene], scene.mesh.points[None], skinning=4)
    with pytest.raises(NotReducibleError, match="effect 'self_collision': needs all vertices"):
        ReducedSpace(scene, columns, [])
