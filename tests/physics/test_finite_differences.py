"""Operators and energies against finite differences."""

import numpy as np
import pytest

from builders import make_scene

STEP = 1e-6


def central(function, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Central difference of ``function`` at ``point`` along ``direction``."""
    return (function(point + STEP * direction) - function(point - STEP * direction)) / (2 * STEP)


def test_energy_gradient_is_the_elastic_force(group_scene, rng):
    """dW/dq = S^T W (S q - p): the projection is the nearest point of a fixed manifold.

    The derivative of p does not enter (envelope theorem); for bending the manifold is fixed by the
    normals of the frame's beginning.
    """
    group, points = group_scene.groups[0], group_scene.mesh.points
    y = points + 0.02 * rng.standard_normal(points.shape)
    group.begin_frame(points)

    def energy(q: np.ndarray) -> float:
        return group.accumulate(q, np.zeros_like(q))

    force = group.S.T @ (group.row_weights[:, None] * (group.S @ y - group.project(y)))
    for _ in range(5):
        direction = rng.standard_normal(points.shape)
        expected = float(np.sum(force * direction))
        assert central(energy, y, direction) == pytest.approx(expected, rel=2e-4)


def test_bending_operator_is_the_gradient_of_area(rng):
    """A_v H_v = d(total area)/dq_v at rest (Pinkall and Polthier 1993)."""
    mesh = {"kind": "cloth", "rows": 7, "columns": 6, "wave": 0.1}
    scene = make_scene({"effect": "bending", "weight": 1.0}, mesh=mesh)
    group, points, triangles = scene.groups[0], scene.mesh.points, scene.mesh.triangles

    def area(q: np.ndarray) -> float:
        a, b, c = (q[triangles[:, i]] for i in range(3))
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    curvature = group.S @ points
    for element in rng.permutation(group.elements)[:5]:
        for axis in range(3):
            direction = np.zeros_like(points)
            direction[group.vertices[element], axis] = 1.0
            expected = curvature[element, axis] * group.weights[element]
            assert central(area, points, direction) == pytest.approx(expected, rel=1e-5, abs=1e-8)
