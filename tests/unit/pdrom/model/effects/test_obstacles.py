"""Obstacles: no vertex ends inside or passes through, friction is Coulomb's; drawn surfaces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import OBSTACLES, depths, make_scene
from pdrom.model.effects.base import effect_config
from strategies import SEEDS

SPRING = {"effect": "spring", "weight": 1.0}
H = 0.016


def obstacle(name, friction=0.0, **changes):
    effect = {"effect": name, "friction": friction, **OBSTACLES[name], **changes}
    (made,) = make_scene(SPRING, effect).contacts
    return made


def distance(name, points):
    """Signed distance to the surface, negative inside, independent of the implementation."""
    if name == "plane":
        return (points - [0.1, 0.2, 0.3]) @ (np.array([1.0, 2.0, -2.0]) / 3.0)
    if name == "sphere":
        return np.linalg.norm(points - [0.1, 0.2, 0.3], axis=1) - 0.7
    beyond = np.abs(points - [0.15, 0.05, -0.05]) - [0.55, 0.55, 0.55]
    return beyond.max(axis=1)


@pytest.mark.parametrize("name", OBSTACLES)
@given(seed=SEEDS, size=st.floats(-3, 4), friction=st.sampled_from([0.0, 0.3, np.inf]))
def test_no_vertex_ends_inside_an_obstacle(name, seed, size, friction):
    rng = np.random.default_rng(seed)
    before = rng.uniform(-1.5, 1.5, (200, 3))
    after = before + 10.0**size * rng.standard_normal((200, 3))
    ended = after.copy()
    obstacle(name, friction).correct(ended, before)
    assert (distance(name, ended) >= -1e-9 * (1.0 + np.abs(after).max())).all()


@pytest.mark.parametrize("name", OBSTACLES)
@given(seed=SEEDS, size=st.floats(-3, 4))
def test_paths_that_miss_the_obstacle_are_unchanged(name, seed, size):
    rng = np.random.default_rng(seed)
    before = rng.uniform(-3.0, 3.0, (100, 3))
    after = before + 10.0**size * rng.standard_normal((100, 3))
    steps = np.linspace(0.0, 1.0, 400)[:, None, None]
    path = (before + steps * (after - before)).reshape(-1, 3)
    nearest = distance(name, path).reshape(400, 100).min(axis=0)
    misses = nearest > np.linalg.norm(after - before, axis=1) / 399.0
    ended = after.copy()
    obstacle(name).correct(ended, before)
    assert np.array_equal(ended[misses], after[misses])


@pytest.mark.parametrize("name", OBSTACLES)
@pytest.mark.parametrize("path", [0.0, 5e-324, 1e-300])
def test_a_path_of_length_zero_is_no_special_case(name, path):
    before = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0], [0.7, 0.0, 0.0], [0.7, 0.6, 0.5]])
    after = before + path
    ended = after.copy()
    obstacle(name, 0.5).correct(ended, before)
    assert (distance(name, ended) >= -1e-12).all()
    outside = distance(name, before) > 1e-9
    assert np.array_equal(ended[outside], after[outside])


@pytest.mark.parametrize("name", OBSTACLES)
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_no_path_passes_through_an_obstacle(name, friction, rng):
    """Aimed at the middle from outside, at ten thousand metres a frame, it stays on its side."""
    middle = np.array([0.1, 0.2, 0.3])
    direction = rng.standard_normal((300, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    before = middle + 3.0 * direction
    before = before[distance(name, before) > 0.0]
    ended = middle - 1e4 * (before - middle)
    obstacle(name, friction).correct(ended, before)
    assert (distance(name, ended) >= -1e-8).all()
    # the body is convex: a plane separates it from both ends of the path
    assert (distance(name, 0.5 * (ended + before)) >= -1e-8).all()


def falling(contact, q, v, frames):
    """Positions and velocities (n, 3) of free vertices after some frames of gravity."""
    q, v = np.array(q), np.array(v)
    for _ in range(frames):
        v[:, 1] -= 9.81 * H
        ended = q + H * v
        contact.correct(ended, q)
        q, v = ended, (ended - q) / H
    return q, v


def test_a_plate_without_thickness_stops_vertices_that_fall_on_it():
    plate = obstacle("box", lower=[-2, 1, -2], upper=[2, 1, 2], friction=0.5)
    q, v = falling(plate, [[0.1, 1.2, 0.0]], [[1.0, -3.0, 0.0]], frames=100)
    assert q[0, 1] == 1.0
    assert np.abs(v).max() == 0.0


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.4, 0.6, 10.0, np.inf])
def test_friction_on_a_slope_follows_coulombs_law(mu):
    """A point slides down a plane of 30 degrees with g (sin - mu cos), or stays if mu > 0.577."""
    tilt = np.radians(30.0)
    slope = obstacle("plane", mu, point=[0, 0, 0], normal=[np.sin(tilt), np.cos(tilt), 0])
    down = np.array([np.cos(tilt), -np.sin(tilt), 0.0])
    q, v = falling(slope, np.zeros((1, 3)), np.zeros((1, 3)), frames=50)
    expected = 9.81 * (np.sin(tilt) - mu * np.cos(tilt)) * 50 * H
    if expected > 0.0:
        assert v[0] == pytest.approx(expected * down)
    else:
        assert np.abs(q).max() < 1e-15


LOW, HIGH = np.array([-0.5, 1.0, -0.5]), np.array([0.7, 2.0, 0.5])
BODIES = {"floor": {"height": 0.3}, **OBSTACLES}


def body(name):
    return effect_config({"effect": name, **BODIES[name]}, 0).body(LOW, HIGH)


@pytest.mark.parametrize("name", BODIES)
def test_drawn_corners_of_an_obstacle_lie_on_its_surface(name):
    (contact,) = make_scene(SPRING, {"effect": name, **BODIES[name]}).contacts
    assert np.abs(depths(contact, body(name).points)).max() < 1e-12
    inside, outside = depths(contact, np.array([[0.0, 0.0, 0.3], [0.0, 9.0, 0.0]]))
    assert outside < 0.0 < inside
