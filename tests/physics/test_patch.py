"""Patch tests with constant strain; energies and operators against finite differences."""

import numpy as np
import pytest

from builders import make_scene

GRADIENT = np.array([[1.3, 0.2, -0.1], [0.05, 0.8, 0.3], [-0.2, 0.1, 1.1]])


@pytest.mark.parametrize("plane", ["xy", "xz"])
def test_triangles_have_the_gradient_of_an_affine_map_exactly(plane):
    """S q of an affinely mapped sheet has the singular values of the map in the sheet's plane."""
    mesh = {"kind": "cloth", "rows": 4, "columns": 5, "plane": plane}
    scene = make_scene({"effect": "strain", "weight": 1.0}, mesh=mesh)
    group = scene.groups[0]
    f = (group.S @ (scene.mesh.points @ GRADIENT.T)).reshape(-1, 2, 3)
    tangent = np.eye(3)[:, [0, 1] if plane == "xy" else [0, 2]]
    expected = np.linalg.svd(GRADIENT @ tangent, compute_uv=False)
    assert np.linalg.svd(f, compute_uv=False) == pytest.approx(
        np.broadcast_to(expected, (len(f), 2)), rel=1e-12
    )


def test_tetrahedra_have_the_gradient_of_an_affine_map_exactly():
    mesh = {"kind": "bar", "nx": 4, "ny": 3, "nz": 3}
    scene = make_scene({"effect": "deformation_gradient", "weight": 1.0}, mesh=mesh)
    group = scene.groups[0]
    f = (group.S @ (scene.mesh.points @ GRADIENT.T)).reshape(-1, 3, 3).transpose(0, 2, 1)
    assert f == pytest.approx(np.broadcast_to(GRADIENT, f.shape), abs=1e-11)


STEP = 1e-6


def central(function, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    return (function(point + STEP * direction) - function(point - STEP * direction)) / (2 * STEP)


def test_energy_gradient_is_the_elastic_force(group_scene, rng):
    """dW/dq = S^T W (S q - p): the projection is the nearest point of a fixed manifold.

    The derivative of p does not enter (envelope theorem); for bending the manifold is fixed by the
    normals of the frame's beginning.
    """
    group, points = group_scene.groups[0].for_run(), group_scene.mesh.points
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
