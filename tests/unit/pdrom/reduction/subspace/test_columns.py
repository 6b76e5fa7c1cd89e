"""Position subspaces: atoms, columns, modes."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import TOP, make_scene, random_rotation
from pdrom.core.errors import SolverError
from pdrom.model.runs import trajectory
from pdrom.reduction.subspace import columns as spaces
from pdrom.reduction.subspace.space import DenseElimination, coordinates
from pdrom.reduction.subspace.training import make_columns

SETS = st.lists(
    st.lists(st.sets(st.integers(0, 19), min_size=1, max_size=8), min_size=1, max_size=3),
    max_size=4,
)


@given(SETS)
def test_atoms_partition_the_fixed_vertices(boundaries):
    found = spaces.atoms([[*unit] for own in boundaries for unit in own], 20)
    units = [unit for boundary in boundaries for unit in boundary]
    members = np.concatenate(found) if found else np.array([], dtype=int)
    assert len(members) == len(set(members.tolist()))
    assert set(members.tolist()) == set().union(*units)
    for atom in found:
        # a unit contains all of an atom or nothing of it
        assert all(set(atom.tolist()) <= unit or not set(atom.tolist()) & unit for unit in units)
    for one in found:
        for other in found:
            # and no two atoms could be merged
            together = [(int(one[0]) in unit) == (int(other[0]) in unit) for unit in units]
            assert one is other or not all(together)


@given(n=st.integers(1, 12), m=st.integers(1, 12), rank=st.integers(0, 12), seed=st.integers(0, 99))
def test_orthonormalisation_keeps_the_span(n, m, rank, seed):
    rng = np.random.default_rng(seed)
    rank = min(rank, n, m)
    columns = rng.standard_normal((n, rank)) @ rng.standard_normal((rank, m))
    q = spaces.orthonormal(columns)
    assert q.shape == (n, rank)
    np.testing.assert_allclose(q.T @ q, np.eye(rank), atol=1e-12)
    np.testing.assert_allclose(q @ (q.T @ columns), columns, atol=1e-7 * (1 + abs(columns).max()))


HELD = (
    TOP,
    {"effect": "translate", "select": "bottom", "offset": [0.0, -0.2, 0.1], "over": 5, "until": 8},
)
SPRING = {"effect": "spring", "weight": 1e5}
GRAVITY = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}


@pytest.fixture(scope="module")
def moved():
    """Scene with vertices of different mass, a pin and a handle, and its trajectory."""
    scene = make_scene(SPRING, GRAVITY, *HELD, frames=12)
    scene.masses[:] = np.random.default_rng(0).uniform(5.0, 20.0, scene.mesh.vertices)
    return scene, trajectory(scene)


@pytest.mark.parametrize("kind", ["pod", "skinning"])
@pytest.mark.parametrize("k", [3, 8])
def test_columns_are_mass_orthonormal_separate_for_atoms_and_span_affine_maps(moved, kind, k, rng):
    """Coordinates give the best approximation in the mass norm."""
    scene, run = moved
    masses, points = scene.masses, scene.mesh.points
    columns = make_columns([scene], run[1:], **{kind: k})
    block = columns.B[:, columns.free]
    np.testing.assert_allclose(
        block.T @ (masses[:, None] * block), np.eye(block.shape[1]), atol=1e-10
    )
    assert columns.modes == k
    # the affine columns of a flat sheet are three
    assert len(columns.free) == k + 3
    held = np.concatenate(columns.atoms)
    assert (columns.B[np.ix_(held, columns.free)] == 0.0).all()
    for atom, own in zip(columns.atoms, columns.atom_columns, strict=True):
        others = np.setdiff1d(np.arange(scene.mesh.vertices), atom)
        assert (columns.B[np.ix_(others, own)] == 0.0).all()
        block = columns.B[np.ix_(atom, own)]
        np.testing.assert_allclose(block.T @ block, np.eye(len(own)), atol=1e-12)
    every = np.concatenate([columns.free, *columns.atom_columns])
    np.testing.assert_array_equal(np.sort(every), np.arange(columns.B.shape[1]))
    assert np.linalg.matrix_rank(columns.B) == columns.B.shape[1]
    moving = points @ random_rotation(rng).T + rng.standard_normal(3)
    for field in (points, moving, points @ rng.standard_normal((3, 3))):
        z = coordinates(columns, masses, field)
        np.testing.assert_allclose(columns.B @ z, field, atol=1e-11)
    field = rng.standard_normal(points.shape)
    left = field - columns.B @ coordinates(columns, masses, field)
    np.testing.assert_allclose(columns.B.T @ (masses[:, None] * left), 0.0, atol=1e-11)


def test_displacement_modes_are_the_mass_weighted_pod_up_to_the_rank_of_the_data(moved):
    """Reference: a dense SVD of the snapshots without their affine part."""
    scene, run = moved
    points, masses = scene.mesh.points, scene.masses
    modes = spaces.displacement_modes(run[1:], points, masses, 5)
    root = np.sqrt(masses)[:, None]
    snapshots = np.hstack([root * (q - points) for q in run[1:]])
    affine = np.linalg.qr(root * spaces.affine_columns(points)[:, :3])[0]
    u = np.linalg.svd(snapshots - affine @ (affine.T @ snapshots))[0][:, :5]
    mine = root * modes
    np.testing.assert_allclose(mine.T @ mine, np.eye(5), atol=1e-10)
    np.testing.assert_allclose(mine @ mine.T, u @ u.T, atol=1e-7)
    bump = np.zeros_like(points)
    bump[7, 2] = 1.0
    bent = np.stack([points + bump, points + 3 * bump])
    for rank, few in enumerate((np.stack([points + 1.0, 2.0 * points]), bent)):
        assert spaces.displacement_modes(few, points, masses, 9).shape[1] == rank


@pytest.mark.parametrize("handles", [1, 2, 5, 12, 30])
def test_skinning_weights_are_a_partition_of_unity(handles):
    points = make_scene(SPRING).mesh.points
    weights = spaces.skinning_weights(points, handles)
    assert weights.shape == (30, handles)
    assert weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-13)
    assert np.linalg.matrix_rank(weights) == handles
    again = spaces.skinning_weights(7.0 * points + 3.0, handles)
    np.testing.assert_allclose(again, weights, atol=1e-12)


@pytest.mark.parametrize("k", [1, 4, 9, 500])
def test_skinning_modes_are_mass_orthonormal_without_affine_part(moved, k):
    """Their number ends at the size of the mesh minus the three affine columns of a flat sheet."""
    scene, _ = moved
    points, masses = scene.mesh.points, scene.masses
    modes, count = spaces.skinning_modes(points, masses, k), min(k, len(points) - 3)
    assert modes.T @ (masses[:, None] * modes) == pytest.approx(np.eye(count), abs=1e-9)
    affine = spaces.affine_columns(points).T @ (masses[:, None] * modes)
    assert affine == pytest.approx(np.zeros((4, count)), abs=1e-8)


def test_a_system_that_cannot_be_solved_is_an_error():
    """Indefinite, or with stiffness 1 between six coordinates and 1e-12 for all together."""
    for matrix in (np.diag([1.0, -1.0]), (1.0 + 1e-12) * np.eye(6) - np.full((6, 6), 1.0 / 6.0)):
        with pytest.raises(SolverError):
            DenseElimination(matrix, np.empty(0, dtype=np.int64))


@pytest.mark.parametrize("mass", [1e-100, 1e-6, 1.0, 1e100])
def test_coordinates_do_not_depend_on_the_unit_of_mass(mass, rng):
    """With fixed vertices, whose columns are not mass-orthonormal; the rest shape is exact."""
    scene = make_scene(TOP, SPRING, vertex_mass=mass)
    points = scene.mesh.points
    motion = points + 0.1 * rng.standard_normal((5, *points.shape))
    columns = make_columns([scene], motion, 4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        z = coordinates(columns, scene.masses, points)
    assert columns.B @ z == pytest.approx(points, abs=1e-12)
