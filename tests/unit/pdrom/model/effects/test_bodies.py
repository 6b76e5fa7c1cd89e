"""Surfaces of obstacles: on the obstacle itself, closed, outwards."""

import numpy as np
import pytest
from hypothesis import given

from builders import OBSTACLES, make_scene
from pdrom.model.effects.base import effect_config
from strategies import SEEDS

LOW, HIGH = np.array([-0.5, 1.0, -0.5]), np.array([0.7, 2.0, 0.5])
BODIES = {"floor": {"height": 0.3}, **OBSTACLES}


def body(name):
    return effect_config({"effect": name, **BODIES[name]}, 0).body(LOW, HIGH)


@pytest.mark.parametrize("name", OBSTACLES)
def test_corners_are_on_the_surface_that_keeps_vertices_out(name):
    (obstacle,) = make_scene(
        {"effect": "spring", "weight": 1.0}, {"effect": name, **OBSTACLES[name]}
    ).contacts
    assert np.abs(obstacle.depths(body(name).points)).max() < 1e-12


def test_the_floor_is_at_its_height():
    assert body("floor").points[:, 1] == pytest.approx(np.full(4, 0.3))


@pytest.mark.parametrize("name", ["sphere", "box"])
def test_a_body_is_closed_and_turned_outwards(name):
    """Every edge has a triangle on each side; the enclosed volume is that of the formula."""
    made = body(name)
    ends = np.sort(made.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(ends, axis=0, return_counts=True)[1] == 2).all()
    volume = np.linalg.det(made.points[made.triangles]).sum() / 6.0
    exact = {"sphere": 4.0 / 3.0 * np.pi * 0.7**3, "box": 1.1**3}[name]
    assert volume == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("name", ["floor", "plane"])
@given(seed=SEEDS)
def test_a_plane_covers_the_region(name, seed):
    """Whatever lies in the region, its foot on the plane is inside the square."""
    made = body(name)
    point = np.random.default_rng(seed).uniform(LOW, HIGH)
    centre, sides = made.points.mean(axis=0), made.points[[1, 3]] - made.points[0]
    along = sides @ (point - centre) / np.einsum("ij,ij->i", sides, sides)
    assert np.abs(along).max() <= 0.5 + 1e-12
    assert abs(sides[0] @ sides[1]) < 1e-12


def test_what_is_no_obstacle_has_no_body():
    assert effect_config({"effect": "gravity"}, 0).body(LOW, HIGH) is None
    assert effect_config({"effect": "self_collision", "thickness": 0.1}, 0).body(LOW, HIGH) is None
