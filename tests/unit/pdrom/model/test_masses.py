"""Masses: one for all, by selection, by density; runs obey them."""

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs import trajectory

SPRING = {"effect": "spring", "weight": 1e5}
BAR = {"kind": "bar", "nx": 4, "ny": 3, "nz": 3, "extent": 2.0}


def test_later_entries_change_what_they_select():
    entries = [{"select": "top", "vertex_mass": 5.0}, {"select": [0], "vertex_mass": 7.0}]
    scene = make_scene(SPRING, vertex_mass=3.0, masses=entries)
    top = scene.mesh.points[:, 1] == scene.mesh.points[:, 1].max()
    expected = np.where(top, 5.0, 3.0)
    expected[0] = 7.0
    assert np.array_equal(scene.masses, expected)


@pytest.mark.parametrize(
    ("effect", "mesh"),
    [
        (SPRING, {"kind": "cloth", "rows": 6, "columns": 5, "extent": 2.0}),
        ({"effect": "tetrahedron_strain", "weight": 1.0}, BAR),
    ],
)
def test_a_density_weighs_the_rest_shape(effect, mesh):
    """Total mass is density times area or volume; vertices inside have more than corners."""
    scene = make_scene(effect, mesh=mesh, masses=[{"density": 0.25}])
    sides = np.ptp(scene.mesh.points, axis=0)
    assert scene.masses.sum() == pytest.approx(0.25 * np.prod(sides[sides > 1e-9]))
    assert scene.masses.max() > 1.5 * scene.masses.min()


def test_a_heavy_side_moves_less_and_the_centre_of_mass_stays():
    heavy = [{"select": "left", "vertex_mass": 1e5}]
    scene = make_scene(SPRING, masses=heavy, frames=10)
    start = 0.05 * (scene.mesh.points - scene.mesh.points.mean(axis=0))
    positions = trajectory(scene, perturbation=start)
    moved = np.linalg.norm(positions[-1] - positions[0], axis=1)
    left = scene.masses > 100.0
    assert moved[left].max() < 0.01 * moved[~left].max()
    centre = np.einsum("n,fna->fa", scene.masses, positions) / scene.masses.sum()
    assert np.abs(centre - centre[0]).max() < 1e-12
