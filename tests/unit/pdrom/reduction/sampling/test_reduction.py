"""Selections and reductions of the presets and of every other combination of ingredients."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from pdrom.core.errors import RankError, SamplingError, StorageError
from pdrom.core.store import write_hdf5
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.sampling import Reduction, Sampling, select, select_path
from pdrom.reduction.sampling.reduction import norm_and_condition, solution_operator
from places import CONFIG
from strategies import SEEDS
from study.experiments.kit.models import load_reduction

ELEMENTS, P = 14, 2
ROWS = ELEMENTS * P
PRESETS = load_methods(CONFIG / "methods.yaml")
INGREDIENTS = {
    "weighting": ("none", "mass"),
    "centring": ("none", "affine", "mean-in-modes"),
    "layout": ("vectorised", "per-axis"),
    "rows": ("all", "scalar", "joint", "element"),
    "selection": ("greedy", "pivoted-qr", "s-opt"),
    "solve": ("square", "qr", "tikhonov"),
    "coefficients": (None, "shared", "per-axis"),
}


def combinations() -> dict[str, MethodSpec]:
    """Every combination of ingredients that the specification admits."""
    specs = {}
    for values in itertools.product(*INGREDIENTS.values()):
        try:
            spec = MethodSpec(title="t", **dict(zip(INGREDIENTS, values, strict=True)))
        except ValidationError:
            continue
        specs["/".join(map(str, values))] = spec
    return specs


EVERY = combinations()
PROJECTIONS = {n: s for n, s in EVERY.items() if s.rows == "all" or s.solve != "tikhonov"}
UNWEIGHTED = {n: s for n, s in PROJECTIONS.items() if s.weighting == "none"}


def data(seed: int, n: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Snapshots (n, rows, 3) and row masses."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, ROWS, 3)) + 2.0, rng.uniform(0.5, 2.0, ROWS)


def reduction_of(p: np.ndarray, mass: np.ndarray, spec: MethodSpec, r: int) -> Reduction:
    """Basis, selection and operator of one method."""
    basis = compute_basis(p, mass, 0.0, P, spec)
    return Reduction(basis, select(basis, spec, r), spec, r)


def made(spec: MethodSpec, seed: int, r: int = 5) -> tuple[np.ndarray, Reduction]:
    p, mass = data(seed)
    return p, reduction_of(p, mass, spec, r)


def span_part(reduction: Reduction, p: np.ndarray) -> np.ndarray:
    """Best approximation of p in mean + span (for each axis if the axes have separate bases)."""
    mean, v = reduction.basis.mean[:, None], reduction.v
    columns = p.reshape(len(p), -1).T - mean
    best = np.zeros_like(columns)
    per_axis = reduction.blocks[0].axis is not None
    for part in (slice(a, None, 3) if per_axis else slice(None) for a in range(3)):
        best[part] = v[part] @ np.linalg.lstsq(v[part], columns[part], rcond=None)[0]
    return (best + mean).T.reshape(p.shape)


@given(seed=SEEDS, name=st.sampled_from(list(EVERY)))
def test_reconstructions_lie_in_the_basis_space_and_reproduce_it(name, seed):
    p, reduction = made(EVERY[name], seed)
    before = p.copy()
    result = reduction.reconstruct(p)
    np.testing.assert_array_equal(p, before)
    assert result.shape == p.shape
    assert np.isfinite(result).all()
    inside = span_part(reduction, result)
    np.testing.assert_allclose(result, inside, atol=1e-10 * np.abs(result).max())
    if name in PROJECTIONS:
        inside, tolerance = span_part(reduction, p), 1e-11 * max(reduction.gain, 1.0)
        np.testing.assert_allclose(reduction.reconstruct(inside), inside, atol=tolerance)


@given(seed=SEEDS, name=st.sampled_from(list(UNWEIGHTED)))
def test_the_deim_constant_is_the_norm_of_the_pseudo_inverse_and_bounds_the_error(name, seed):
    """|| p - p^ || <= gain || (I - V V^T)(p - mean) || for data outside the training set."""
    p, reduction = made(PROJECTIONS[name], seed)
    if UNWEIGHTED[name].rows != "all":
        matrices = [block.matrix for block in reduction.blocks]
        norm = max(np.linalg.norm(np.linalg.pinv(a), 2) for a in matrices)
        assert reduction.gain == pytest.approx(norm, rel=1e-6)
        condition = max(map(np.linalg.cond, matrices))
        assert reduction.condition == pytest.approx(condition, rel=1e-6)
    assert reduction.gain >= 1.0 - 1e-12
    unseen = np.random.default_rng(seed + 1).standard_normal(p.shape)
    best = unseen - span_part(reduction, unseen)
    error = unseen - reduction.reconstruct(unseen)
    bound = reduction.gain * np.linalg.norm(best, axis=(1, 2))
    assert (np.linalg.norm(error, axis=(1, 2)) <= bound * (1.0 + 1e-10)).all()


def test_selections_and_numbers_of_rows_and_elements_are_those_of_the_presets():
    """No two methods select the same entries, so that each algorithm is used."""
    by_name = {name: made(spec, 21, 7)[1] for name, spec in PRESETS.items()}
    names = ("deim", "qdeim", "deim-joint", "block-deim", "block-qdeim")
    rows = [by_name[name].rows_sampled for name in ("pod", *names[2:])]
    assert rows == [ROWS, 7, 7 * P, 7 * P]
    assert len({tuple(by_name[name].sampling.entries.tolist()) for name in names}) == len(names)
    for reduction in by_name.values():
        assert len(reduction.elements) == len(np.unique(reduction.elements))


def test_an_axis_of_rounding_errors_does_not_enter_the_shared_row_selection():
    """In a planar scene z has only rounding errors and coefficients of zero."""
    p, mass = data(13)
    p[:, :, 2] = 1e-17 * np.random.default_rng(1).standard_normal(p.shape[:2])
    spec = PRESETS["deim-joint"]
    basis = compute_basis(p, mass, 1e-13, P, spec)
    reduction = Reduction(basis, select(basis, spec, 5), spec, 5)
    assert [b.axis for b in reduction.blocks] == [0, 1]
    assert np.isfinite(reduction.gain)
    assert not reduction.reconstruct(p)[:, :, 2].any()


def test_an_axis_with_a_singular_system_is_a_failure_without_an_exception():
    """z has a signal only in a mode beyond r: at r its system is zero, without rounding errors."""
    spec = PRESETS["deim-joint"]
    rng = np.random.default_rng(2)
    p = np.zeros((6, ROWS, 3))
    p[:5, :, :2] = 10.0 * rng.standard_normal((5, ROWS, 2))
    p[5, :, 2] = 1e-3 * rng.standard_normal(ROWS)
    basis = compute_basis(p, np.ones(ROWS), 1e-10, P, spec)
    # exact zeros, as in an exactly planar run
    v = basis.V.copy()
    v.reshape(ROWS, 3, -1)[:, 2, :5] = 0.0
    basis = Basis(**{**vars(basis), "V": v})
    reduction = Reduction(basis, select(basis, spec, 5), spec, 5)
    assert basis.active_axes == (True, True, True)
    assert (reduction.gain, reduction.condition) == (np.inf, np.inf)
    result = reduction.reconstruct(p)
    assert np.isnan(result[:, :, 2]).all()
    assert np.isfinite(result[:, :, :2]).all()


@given(name=st.sampled_from(list(EVERY)))
def test_a_selection_path_contains_the_selection_of_every_rank(name):
    spec = EVERY[name]
    p, mass = data(19)
    basis = compute_basis(p, mass, 0.0, P, spec)
    path = select_path(basis, spec, [2, 5, 3])
    assert set(path) == {2, 3, 5}
    for r, sampling in path.items():
        np.testing.assert_equal(vars(sampling), vars(select(basis, spec, r)))
    assert select_path(basis, spec, []) == {}
    for ranks in ([0, 3], [3, 9], [-1]):
        with pytest.raises(RankError, match=f"allowed are 1 to {basis.rank}"):
            select_path(basis, spec, ranks)


def test_a_reduction_read_from_files_is_the_same(tmp_path):
    path, (p, own) = tmp_path / "sampling.h5", made(PRESETS["deim"], 27, 4)
    with write_hdf5(path) as file:
        file["r0004/entries"], file["r0004/elements"] = own.sampling.entries, own.elements
    loaded = load_reduction(own.basis, path, own.spec, 4)
    np.testing.assert_array_equal(loaded.reconstruct(p), own.reconstruct(p))
    with pytest.raises(StorageError, match=r"sampling\.h5"):
        load_reduction(own.basis, path, own.spec, 5)


@pytest.mark.parametrize("selection", INGREDIENTS["selection"])
@pytest.mark.parametrize("rows", ["scalar", "element"])
def test_oversampling_starts_from_the_selection_and_lowers_the_deim_constant(rows, selection):
    """Single entries and elements, with three samples a mode or a bounded DEIM constant."""
    p, mass = data(11)
    start = MethodSpec(title="t", centring="affine", rows=rows, selection=selection, solve="qr")
    reductions = {
        key: reduction_of(p, mass, start.model_copy(update=changes), 4)
        for key, changes in {
            "start": {},
            "three": {"oversampling": 3},
            "bounded": {"oversampling": 2, "gain_bound": 1.5},
        }.items()
    }
    first = reductions["start"].sampling.entries
    for reduction in reductions.values():
        np.testing.assert_array_equal(reduction.sampling.entries[: len(first)], first)
        assert reduction.gain <= reductions["start"].gain * (1.0 + 1e-12)
    per_sample = 1 if rows == "scalar" else 3 * P
    assert len(reductions["three"].sampling.entries) == 12 * per_sample
    assert len(reductions["bounded"].sampling.entries) >= 8 * per_sample
    assert reductions["bounded"].gain <= 1.5


def test_entries_belong_to_elements_in_order_of_need():
    """With two rows, an element has six entries; element-wise sampling needs all of them."""
    sampling = Sampling.of_entries(np.array([13, 0, 17, 30, 5]), 2, 6)
    assert sampling.entries.tolist() == [13, 0, 17, 30, 5]
    assert sampling.elements.tolist() == [2, 0, 5]
    sampling = Sampling.of_elements(np.array([3, 1]), 1, 4)
    assert sampling.entries.tolist() == [9, 10, 11, 3, 4, 5]
    assert sampling.elements.tolist() == [3, 1]


def test_faulty_selected_entries_are_refused():
    for entries in ([], [-1], [36], [0, 36], [3, 3]):
        with pytest.raises(SamplingError):
            Sampling.of_entries(np.array(entries, dtype=int), 2, 6)
    assert Sampling.of_entries(np.array([3, 3]), 1, 4, repeats=True).entries.tolist() == [3, 3]
    with pytest.raises(SamplingError):
        Sampling.of_elements(np.array([2, 2]), 1, 4)


def full_rank(rows: int, columns: int, seed: int) -> np.ndarray:
    """Random matrix with singular values between 0.1 and 1."""
    rng = np.random.default_rng(seed)
    u = np.linalg.qr(rng.standard_normal((rows, columns)))[0]
    w = np.linalg.qr(rng.standard_normal((columns, columns)))[0]
    return u * rng.uniform(0.1, 1.0, columns) @ w.T


@given(st.integers(1, 12), st.integers(0, 20), SEEDS)
def test_square_and_qr_solves_equal_the_pseudo_inverse(r, extra, seed):
    """The square solve is refused if there are more equations than unknowns."""
    a = full_rank(r + extra, r, seed)
    before = a.copy()
    square, qr = (solution_operator(a, solve, 1e-8) for solve in ("square", "qr"))
    np.testing.assert_allclose(qr, np.linalg.pinv(a), atol=1e-11)
    np.testing.assert_allclose(square, qr if extra == 0 else np.full_like(qr, np.nan), atol=1e-11)
    np.testing.assert_array_equal(a, before)


@given(st.integers(1, 12), st.integers(0, 20), SEEDS)
def test_a_tikhonov_solve_minimises_its_functional(r, extra, seed):
    """c minimises |A c - b|^2 + t |c|^2: least squares of the system [A; sqrt(t) I]."""
    a, t = full_rank(r + extra, r, seed), 1e-3
    stacked = np.vstack([a, np.sqrt(t) * np.eye(r)])
    reference = np.linalg.pinv(stacked)[:, : len(a)]
    np.testing.assert_allclose(solution_operator(a, "tikhonov", t), reference, atol=1e-11)


SINGULAR = {
    "zero": np.zeros((3, 3)),
    "repeated row": np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [0.0, 1.0, 1.0]]),
    "zero column": np.array([[1.0, 0.0, 3.0], [2.0, 0.0, 1.0], [0.5, 0.0, 1.0]]),
    "nearly": np.diag([1.0, 1.0, 1e-17]),
    "few rows": np.ones((2, 3)),
}


@pytest.mark.parametrize("name", SINGULAR)
def test_singular_systems_have_an_infinite_deim_constant_unless_regularised(name):
    """The published code has a finite operator of norm at most 1 / (2 sqrt(t))."""
    a = SINGULAR[name]
    for solve in ("square", "qr"):
        operator = solution_operator(a, solve, 1e-8)
        assert operator.shape == a.shape[::-1]
        assert np.isnan(operator).all()
        assert norm_and_condition(a, operator) == (np.inf, np.inf)
    operator = solution_operator(a, "tikhonov", 1e-8)
    assert np.isfinite(operator).all()
    assert np.linalg.norm(operator, 2) <= 0.5e4 * (1.0 + 1e-6)
