"""Patch tests: a constant strain is seen exactly and projected analytically."""

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs import trajectory

GRADIENT = np.array([[1.3, 0.2, -0.1], [0.05, 0.8, 0.3], [-0.2, 0.1, 1.1]])


@pytest.mark.parametrize("plane", ["xy", "xz"])
def test_triangles_see_a_constant_gradient(plane):
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


def test_tetrahedra_see_a_constant_gradient():
    mesh = {"kind": "bar", "nx": 4, "ny": 3, "nz": 3}
    scene = make_scene({"effect": "deformation_gradient", "weight": 1.0}, mesh=mesh)
    group = scene.groups[0]
    f = (group.S @ (scene.mesh.points @ GRADIENT.T)).reshape(-1, 3, 3).transpose(0, 2, 1)
    assert f == pytest.approx(np.broadcast_to(GRADIENT, f.shape), abs=1e-11)


def test_stretched_spring_relaxes_to_its_rest_length():
    """One loose triangle of springs, heavy damping by the implicit step: rest lengths return."""
    mesh = {"kind": "cloth", "rows": 2, "columns": 2}
    scene = make_scene(
        {"effect": "spring", "weight": 1e5}, {"effect": "damping", "rate": 10.0}, mesh=mesh,
        frames=300,
    )  # fmt: skip
    stretched = 0.2 * (scene.mesh.points - scene.mesh.points.mean(axis=0))
    group = scene.groups[0]
    lengths = np.linalg.norm(group.S @ trajectory(scene, stretched)[-1], axis=1)
    assert lengths == pytest.approx(np.linalg.norm(group.rest, axis=1), rel=1e-3)
