"""Bases of snapshots: every ingredient, and degenerate input."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import linalg

from pdrom.core.errors import RankError, SnapshotError
from pdrom.reduction.basis import Basis, compute_basis, load_basis, save_basis
from pdrom.reduction.method import BasisSpec
from strategies import SEEDS

WEIGHTINGS, LAYOUTS = ("none", "mass"), ("vectorised", "per-axis")
CENTRINGS = ("none", "affine", "mean-in-modes")
SPECS = [
    BasisSpec(weighting=w, centring=c, layout=layout)
    for w, c, layout in itertools.product(WEIGHTINGS, CENTRINGS, LAYOUTS)
]
ROWS = 12


def basis_of(
    p: np.ndarray, spec: BasisSpec, roundoff: float = 0.0, mass: np.ndarray | None = None, **kw
) -> Basis:
    """Basis of snapshots with three rows an element; unit masses unless given."""
    mass = np.ones(p.shape[1]) if mass is None else mass
    return compute_basis(p, mass, roundoff, 3, spec, **kw)


def snapshots(seed: int, n: int = 7) -> tuple[np.ndarray, np.ndarray]:
    """Random snapshots (n, 12, 3) about a common mean, and row masses (12,)."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, ROWS, 3)) + 3.0, rng.uniform(0.1, 10.0, ROWS)


every_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.basis_id)


@given(seed=SEEDS)
@every_spec
def test_modes_are_orthonormal_in_their_inner_product_and_span_the_snapshots(spec, seed):
    p, mass = snapshots(seed)
    kept = p.copy(), mass.copy()
    basis = basis_of(p, spec, mass=mass)
    np.testing.assert_equal((p, mass), kept)
    weight = np.repeat(mass if spec.weighting == "mass" else np.ones(ROWS), 3)[:, None]
    columns = p.reshape(len(p), -1).T - basis.mean[:, None]
    for part in (slice(a, None, 3) for a in range(3)) if spec.separate_axes else [slice(None)]:
        v, own = basis.V[part], columns[part]
        assert np.abs(v.T @ (weight[part] * v) - np.eye(basis.rank)).max() < 1e-12
        if spec.centring != "mean-in-modes":
            assert np.abs(own - v @ np.linalg.lstsq(v, own, rcond=None)[0]).max() < 1e-10


def test_singular_values_are_those_of_the_weighted_centred_matrix():
    p, mass = snapshots(11)
    basis = basis_of(p, BasisSpec(weighting="mass", centring="affine"), mass=mass)
    centred = (p - p.mean(axis=0)) * np.sqrt(mass)[:, None]
    reference = np.linalg.svd(centred.reshape(len(p), -1).T, compute_uv=False)
    np.testing.assert_allclose(basis.singular_values, reference, atol=1e-13 * reference[0])
    assert basis.rank == len(p) - 1


def test_per_axis_layout_is_three_separate_pods():
    p, _ = snapshots(13)
    basis = basis_of(p, BasisSpec(layout="per-axis"))
    squares = np.zeros(len(p))
    for a in range(3):
        u, sigma, _ = np.linalg.svd(p[:, :, a].T, full_matrices=False)
        ours = basis.V.reshape(ROWS, 3, -1)[:, a]
        np.testing.assert_allclose(np.abs(u.T @ ours), np.eye(len(p)), atol=1e-10)
        squares += sigma**2
    np.testing.assert_allclose(basis.singular_values, np.sqrt(squares), rtol=1e-12)


def published_modes(p: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """The published recipe with a dense SVD: divide by the deviation, POD, multiply, add, QR."""
    matrix = p.reshape(len(p), -1).T
    first = matrix[:, 0]
    deviation = np.std(matrix - first[:, None])
    u, sigma, _ = np.linalg.svd((matrix - first[:, None]) / deviation, full_matrices=False)
    rank = int((sigma > 1e-10 * sigma[0]).sum())
    u = u[:, :rank] * np.sign(u[np.abs(u[:, :rank]).argmax(axis=0), range(rank)]) * signs[:rank]
    modes = u * deviation + first[:, None]
    for a in range(3):
        modes[a::3] = linalg.qr(modes[a::3], mode="economic")[0]
    return modes


def test_the_mean_among_the_modes_follows_the_published_recipe():
    p, _ = snapshots(17)
    basis = basis_of(p, BasisSpec(centring="mean-in-modes"))
    wanted = published_modes(p, np.ones(len(p)))
    assert basis.V.shape == wanted.shape
    assert not basis.mean.any()
    for a in range(3):
        np.testing.assert_allclose(
            np.abs(basis.V[a::3].T @ wanted[a::3]), np.eye(basis.rank), atol=1e-10
        )


def test_the_mean_among_the_modes_gives_another_space_for_other_signs():
    p, _ = snapshots(19)
    spec = BasisSpec(centring="mean-in-modes")
    fixed = basis_of(p, spec)
    seeds = range(6)
    flipped = [basis_of(p, spec, signs=np.random.default_rng(s)) for s in seeds]
    angles = [linalg.subspace_angles(fixed.V[::3], b.V[::3])[0] for b in flipped]
    assert max(angles) > 1e-2
    again = basis_of(p, spec, signs=np.random.default_rng(0))
    np.testing.assert_array_equal(again.V, flipped[0].V)
    for spec in (BasisSpec(centring="none"), BasisSpec(centring="affine")):
        other = basis_of(p, spec, signs=np.random.default_rng(1))
        np.testing.assert_array_equal(basis_of(p, spec).V, other.V)


@every_spec
def test_tiny_and_huge_snapshots_have_the_basis_of_ordinary_ones(spec):
    """Squares of the entries underflow or overflow; scaling by a power of two changes no digit."""
    p, mass = snapshots(23)
    basis = basis_of(p, spec, roundoff=1e-4, mass=mass)
    for unit in (2.0**-1000, 2.0**660, 2.0**1015):
        other = basis_of(unit * p, spec, roundoff=unit * 1e-4, mass=mass)
        assert (other.rank, other.active_axes) == (basis.rank, basis.active_axes)
        np.testing.assert_array_equal(other.V, basis.V)
        np.testing.assert_array_equal(other.mean, unit * basis.mean)
        np.testing.assert_array_equal(other.singular_values, unit * basis.singular_values)
    assert {basis_of(unit * p, spec, mass=mass).rank for unit in (1e-300, 1e200)} == {basis.rank}
    for faulty, roundoff in ((p / p.max() * 1.7e308, 0.0), (p, np.inf)):
        with pytest.raises(SnapshotError):
            basis_of(faulty, BasisSpec(), roundoff=roundoff)


@given(seed=SEEDS, n=st.integers(2, 40), exponent=st.integers(-8, 8))
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_constant_snapshots_have_a_mean_and_no_modes(weighting, layout, seed, n, exponent):
    """Only rounding errors remain after subtracting the mean, for every number and every scale."""
    one, mass = snapshots(seed, 1)
    p = np.repeat(one, n, axis=0) * 10.0**exponent
    for centring in ("affine", "mean-in-modes"):
        spec = BasisSpec(weighting=weighting, centring=centring, layout=layout)
        assert basis_of(p, spec, mass=mass).rank == 0
    basis = basis_of(p, BasisSpec(centring="affine"))
    np.testing.assert_allclose(basis.mean, p[0].ravel(), rtol=1e-13)


@every_spec
def test_a_flat_axis_gets_no_modes_and_is_flagged(spec, rng):
    p = rng.standard_normal((7, ROWS, 3))
    p[:, :, 2] = 1e-17 * rng.standard_normal((7, ROWS))
    basis = basis_of(p, spec, roundoff=1e-14)
    assert basis.active_axes == (True, True, False)
    if spec.separate_axes:
        assert not basis.V[2::3].any()
    assert np.abs(basis.V[2::3]).max() < 1e-14


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_snapshots_that_are_not_finite_are_refused(bad):
    p, _ = snapshots(29)
    p[2, 3, 1] = bad
    with pytest.raises(SnapshotError, match=r"\(2, 3, 1\)"):
        basis_of(p, BasisSpec())


@pytest.mark.parametrize("shape", [(1, 12, 3), (5, 12), (5, 12, 2), (5, 0, 3), (5, 11, 3)])
def test_snapshots_of_wrong_shape_are_refused(shape):
    with pytest.raises(SnapshotError, match="required"):
        compute_basis(np.ones(shape), np.ones(shape[1]), 0.0, 3, BasisSpec())


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan])
def test_rows_without_mass_are_refused(mass):
    p, masses = snapshots(31)
    masses[4] = mass
    for faulty, spec in ((masses, BasisSpec(weighting="mass")), (masses[1:], BasisSpec())):
        with pytest.raises(SnapshotError, match="row_mass"):
            basis_of(p, spec, mass=faulty)


@every_spec
def test_a_basis_is_read_as_it_was_written(spec, tmp_path):
    path = tmp_path / "scene" / "group" / f"{spec.basis_id}.h5"
    basis = basis_of(snapshots(41)[0], spec)
    save_basis(basis, path)
    loaded = load_basis(path)
    np.testing.assert_equal(vars(loaded), {**vars(basis), "origin": loaded.origin})
    with pytest.raises(RankError, match=rf"scene/group/{spec.basis_id}\.h5: r = 99"):
        loaded.truncated(99)
    save_basis(basis_of(np.zeros((4, ROWS, 3)), spec), path)
    assert load_basis(path).V.shape == (3 * ROWS, 0)
