"""Choices of the published code that act on the simulation, each against what it is said to do."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders import make_scene
from study.experiments.published_choices.simulation import (
    applicable,
    projections,
    row_sizes,
    turned,
)

GRAVITY, FLOOR = {"effect": "gravity"}, {"effect": "floor"}
TOP = {"effect": "pins", "select": "top"}
SPRING = {"effect": "spring", "weight": 1e4}
BAR = {"kind": "bar", "nx": 6, "ny": 3, "nz": 3}
GRADIENT = {"effect": "deformation_gradient", "weight": 1e6}


@pytest.fixture
def sheet():
    return make_scene(GRAVITY, FLOOR, TOP, SPRING, frames=8)


@pytest.fixture
def clamped():
    left = {"effect": "pins", "select": "left"}
    return make_scene(GRAVITY, FLOOR, left, GRADIENT, mesh=BAR, frames=8)


def test_only_choices_that_can_change_something_apply(sheet, clamped):
    group = sheet.group("spring")
    assert applicable(sheet, group) == (
        "pins", "stiffness", "floor", "frames", "weighting", "idle", "signs", "system",
    )  # fmt: skip
    group = clamped.group("deformation_gradient")
    assert applicable(clamped, group) == (
        "heavy", "floor", "mesh", "turns", "frames", "weighting", "signs", "system", "rows",
    )  # fmt: skip


def test_a_sheet_that_nothing_holds_falls_freely(sheet):
    """Its springs keep their rest length; those of the pinned one do not."""
    rest = sheet.group("spring").S @ sheet.mesh.points
    held, _ = projections(sheet, "spring", frozenset())
    falling, _ = projections(sheet, "spring", {"pins"})
    np.testing.assert_allclose(falling, np.broadcast_to(rest, falling.shape), atol=1e-9)
    assert np.abs(held - rest).max() > 1e-6


def test_heavy_pins_hold_as_well_as_eliminated_ones(clamped):
    exact, _ = projections(clamped, "deformation_gradient", frozenset())
    heavy, _ = projections(clamped, "deformation_gradient", {"heavy"})
    assert 0.0 < np.abs(heavy - exact).max() < 1e-5


def test_the_floor_acts_before_the_iterations():
    """A sheet that begins on the floor is compressed by it in the first frame already."""
    mesh = {"kind": "cloth", "rows": 6, "columns": 5, "lift": 0.4}
    scene = make_scene(GRAVITY, FLOOR, SPRING, mesh=mesh, frames=1)
    rest = scene.group("spring").S @ scene.mesh.points
    after, _ = projections(scene, "spring", frozenset())
    before, _ = projections(scene, "spring", {"floor"})
    np.testing.assert_allclose(after[0], rest, atol=1e-12)
    assert np.abs(before[0] - rest).max() > 1e-9


def test_the_other_mesh_is_the_mirrored_one_in_another_order(clamped):
    """The weights of its rows, sums of the volumes around four vertices, are the same numbers."""
    name = "deformation_gradient"
    _, ours = projections(clamped, name, frozenset())
    _, theirs = projections(clamped, name, {"mesh"})
    np.testing.assert_allclose(np.sort(theirs), np.sort(ours))
    assert np.abs(theirs - ours).max() > 0.1 * ours.max()


def test_elements_that_are_neither_flat_nor_inverted_turn_alike(clamped, rng):
    group = clamped.group("deformation_gradient")
    y = Rotation.random(rng=rng).apply(clamped.mesh.points)
    y += 0.02 * clamped.mesh.extent / 6 * rng.standard_normal(y.shape)
    np.testing.assert_allclose(turned(group, y), group.project(y), atol=1e-12)


def test_an_inverted_element_gets_a_rotation_that_is_not_the_nearest(clamped):
    group = clamped.group("deformation_gradient")
    y = clamped.mesh.points * [1.0, -0.5, 1.0]
    rotations = turned(group, y).reshape(-1, 3, 3)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0)
    identity = np.broadcast_to(np.eye(3), rotations.shape)
    np.testing.assert_allclose(rotations @ rotations.transpose(0, 2, 1), identity, atol=1e-12)
    mirrored = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), rotations.shape)
    np.testing.assert_allclose(rotations, mirrored, atol=1e-12)  # the third axis, not the second
    nearest = group.project(y).reshape(-1, 3, 3)
    deformed = np.diag([1.0, -0.5, 1.0])
    assert np.linalg.norm(nearest - deformed) < np.linalg.norm(rotations - deformed)


def test_triangles_are_projected_in_the_plane_of_the_sheet(scene_of):
    strain = {"effect": "strain", "weight": 1e4}
    wind = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}
    scene = make_scene(wind, TOP, strain, frames=4)
    out_of_plane, _ = projections(scene, "strain", frozenset())
    in_plane, _ = projections(scene, "strain", {"plane"})
    assert np.abs(out_of_plane[:, :, 2]).max() > 1e-6
    assert not in_plane[:, :, 2].any()


def test_the_areas_of_all_vertices_sum_to_the_sheet(sheet):
    """Every edge has the areas of its two vertices, and a vertex as many edges as neighbours."""
    group, mesh = sheet.group("spring"), sheet.mesh
    edges = group.element_vertices(mesh)
    valence = np.bincount(edges.ravel(), minlength=mesh.vertices)
    weights = np.linalg.lstsq(np.eye(mesh.vertices)[edges].sum(axis=1), row_sizes(group, mesh))[0]
    sides = np.ptp(mesh.points, axis=0)
    assert valence.min() >= 2
    np.testing.assert_allclose(weights.sum(), sides[0] * sides[1])
