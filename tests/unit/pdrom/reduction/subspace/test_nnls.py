"""Non-negative least squares with early stop, against SciPy and against all supports."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from pdrom.reduction.subspace.ecsw import nnls_path

SMOOTH = np.exp(-np.outer(np.linspace(0.0, 1.0, 60), np.linspace(0.1, 5.0, 200)))


def stopped(g: np.ndarray, b: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    return nnls_path(g, b, [tolerance])[0]


def dense(support, values, size) -> np.ndarray:
    x = np.zeros(size)
    x[support] = values
    return x


@given(
    m=st.integers(1, 25), e=st.integers(1, 25), seed=st.integers(0, 2**31), scale=st.floats(-6, 6)
)
def test_without_tolerance_it_is_the_method_of_lawson_and_hanson(m, e, seed, scale):
    rng = np.random.default_rng(seed)
    g = 10.0**scale * rng.standard_normal((m, e)) * 10.0 ** rng.uniform(-2, 2, e)
    b = rng.standard_normal(m)
    before = g.copy(), b.copy()
    support, values = stopped(g, b, 0.0)
    np.testing.assert_array_equal(g, before[0])
    np.testing.assert_array_equal(b, before[1])
    x = dense(support, values, e)
    best, norm = nnls(g, b)
    assert (values > 0.0).all()
    assert (np.diff(support) > 0).all()
    assert np.linalg.norm(g @ x - b) <= norm + 1e-7 * np.linalg.norm(b)
    np.testing.assert_allclose(g @ x, g @ best, atol=1e-5 * np.linalg.norm(b))


@pytest.mark.parametrize("tolerance", [0.5, 0.1, 1e-2, 1e-4])
def test_stops_at_the_tolerance_with_few_columns(tolerance):
    """Sum of many smooth columns: far fewer of them suffice."""
    g, b = SMOOTH, SMOOTH.sum(axis=1)
    support, values = stopped(g, b, tolerance)
    assert np.linalg.norm(g[:, support] @ values - b) <= tolerance * np.linalg.norm(b)
    assert 0 < len(support) < 15
    finer = stopped(g, b, tolerance / 10.0)[0]
    assert len(finer) >= len(support)


def test_blocks_of_columns_end_at_the_same_minimum(rng):
    """Large enough that several columns join at a time and that columns leave."""
    g = rng.standard_normal((150, 400)) + 0.2 * rng.standard_normal((150, 1))
    b = g[:, :80].sum(axis=1) + 10.0 * rng.standard_normal(150)
    support, values = stopped(g, b, 0.0)
    best, norm = nnls(g, b)
    assert len(support) > 40
    assert np.linalg.norm(g @ dense(support, values, 400) - b) == pytest.approx(norm, rel=1e-8)
    np.testing.assert_allclose(dense(support, values, 400), best, atol=1e-6)


def test_a_path_meets_each_of_its_tolerances():
    g, b = SMOOTH, SMOOTH.sum(axis=1)
    path = nnls_path(g, b, [1e-3, 0.5, 1e-2])
    for (support, values), tolerance in zip(path, [1e-3, 0.5, 1e-2], strict=True):
        assert (values > 0.0).all()
        assert np.linalg.norm(g[:, support] @ values - b) <= tolerance * np.linalg.norm(b)
    assert len(path[1][0]) <= len(path[2][0]) <= len(path[0][0])
    for one, two in zip(path[1], stopped(g, b, 0.5), strict=True):
        np.testing.assert_array_equal(one, two)


def test_support_is_bounded(rng):
    g = np.abs(rng.standard_normal((40, 60)))
    b = g.sum(axis=1)
    assert 7 < len(stopped(g, b, 0.0)[0]) <= 40


@pytest.mark.parametrize(
    ("g", "b", "expected"),
    [
        (np.eye(3), np.array([1.0, -1.0, 2.0]), {0: 1.0, 2: 2.0}),
        (np.eye(3), -np.ones(3), {}),
        (np.eye(3), np.zeros(3), {}),
        (np.zeros((3, 4)), np.ones(3), {}),
        (np.column_stack([np.zeros(2), [2.0, 0.0]]), np.array([4.0, 0.0]), {1: 2.0}),
    ],
)
def test_known_solutions(g, b, expected):
    support, values = stopped(g, b, 0.0)
    assert dict(zip(support.tolist(), values.tolist(), strict=True)) == pytest.approx(expected)


def test_repeated_columns_end(rng):
    column = np.abs(rng.standard_normal(30))
    g = np.column_stack([column] * 10 + [2.0 * column] * 5)
    support, values = stopped(g, 3.0 * column + 1e-3, 0.0)
    assert len(support) == 1
    assert g[:, support] @ values == pytest.approx(3.0 * column, rel=0.1)
