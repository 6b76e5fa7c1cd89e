"""Reduced coordinates and the reduced system in hard conditions."""

import warnings

import numpy as np
import pytest

from builders import make_scene
from pdrom.core.errors import SolverError
from pdrom.reduction.subspace.model import make_columns
from pdrom.reduction.subspace.space import DenseElimination, coordinates

NOTHING = np.empty(0, dtype=np.int64)


def test_an_indefinite_system_is_a_named_error():
    with pytest.raises(SolverError, match="reduced system of size 2"):
        DenseElimination(np.diag([1.0, -1.0]), NOTHING)


def test_a_system_without_enough_digits_is_a_named_error():
    """A stiffness of 1 between six coordinates, and 1e-12 of it for all of them together."""
    matrix = np.eye(6) - np.full((6, 6), 1.0 / 6.0) + 1e-12 * np.eye(6)
    with pytest.raises(SolverError, match="a solve is wrong by"):
        DenseElimination(matrix, NOTHING)


def test_a_regular_system_is_solved(rng):
    root = rng.standard_normal((6, 6))
    matrix, rhs, y = root @ root.T + np.eye(6), rng.standard_normal((6, 3)), np.zeros((6, 3))
    fixed = np.array([2])
    elimination = DenseElimination(matrix, fixed)
    elimination.set_targets(np.ones((1, 3)))
    y[fixed] = 1.0
    elimination.solve(rhs, y)
    free = [0, 1, 3, 4, 5]
    assert (matrix @ y)[free] == pytest.approx(rhs[free])


@pytest.mark.parametrize("mass", [1e-100, 1e-6, 1.0, 1e100])
def test_coordinates_do_not_depend_on_the_unit_of_mass(mass, rng):
    """With held vertices, whose columns are not mass-orthonormal; the rest shape is met exactly."""
    scene = make_scene(
        {"effect": "pins", "select": "top"}, {"effect": "spring", "weight": 1e5}, vertex_mass=mass
    )
    points = scene.mesh.points
    motion = points + 0.1 * rng.standard_normal((5, *points.shape))
    columns = make_columns(scene, motion, "pod", 4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        z = coordinates(columns, scene.masses, points)
    assert columns.B @ z == pytest.approx(points, abs=1e-12)
