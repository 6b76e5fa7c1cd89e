"""Solution operators of the sampled equations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.reduction.sampling.reduction import norm_and_condition, solution_operator

SEEDS = st.integers(0, 2**32 - 1)


def full_rank(rows: int, columns: int, seed: int) -> np.ndarray:
    """Random matrix with singular values between 0.1 and 1."""
    rng = np.random.default_rng(seed)
    u = np.linalg.qr(rng.standard_normal((rows, columns)))[0]
    w = np.linalg.qr(rng.standard_normal((columns, columns)))[0]
    return u * rng.uniform(0.1, 1.0, columns) @ w.T


@given(st.integers(1, 12), SEEDS)
def test_square_is_the_inverse(r, seed):
    a = full_rank(r, r, seed)
    before = a.copy()
    operator = solution_operator(a, "square", 1e-8)
    np.testing.assert_array_equal(a, before)
    np.testing.assert_allclose(operator, np.linalg.inv(a), atol=1e-11)


@given(st.integers(1, 12), st.integers(0, 20), SEEDS)
def test_qr_is_the_pseudo_inverse(r, extra, seed):
    a = full_rank(r + extra, r, seed)
    np.testing.assert_allclose(solution_operator(a, "qr", 1e-8), np.linalg.pinv(a), atol=1e-11)


@given(st.integers(1, 12), st.integers(0, 20), SEEDS)
def test_tikhonov_minimises_its_functional(r, extra, seed):
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


@pytest.mark.parametrize("solve", ["square", "qr"])
@pytest.mark.parametrize("name", SINGULAR)
def test_singular_systems_have_no_operator_and_infinite_gain(name, solve):
    a = SINGULAR[name]
    operator = solution_operator(a, solve, 1e-8)
    assert operator.shape == a.shape[::-1]
    assert np.isnan(operator).all()
    assert norm_and_condition(a, operator) == (np.inf, np.inf)


def test_square_refuses_an_overdetermined_system():
    a = full_rank(5, 3, 1)
    assert np.isnan(solution_operator(a, "square", 1e-8)).all()
    assert np.isfinite(solution_operator(a, "qr", 1e-8)).all()


@pytest.mark.parametrize("name", SINGULAR)
def test_tikhonov_hides_singular_systems(name):
    """What the published code does: a finite operator of norm at most 1 / (2 sqrt(t))."""
    operator = solution_operator(SINGULAR[name], "tikhonov", 1e-8)
    assert np.isfinite(operator).all()
    assert np.linalg.norm(operator, 2) <= 0.5e4 * (1.0 + 1e-6)


def test_norm_and_condition_of_known_systems():
    a = np.diag([4.0, 2.0, 0.5])
    assert norm_and_condition(a, np.linalg.inv(a)) == pytest.approx((2.0, 8.0))
    damped = solution_operator(a, "tikhonov", 0.25)
    # sigma / (sigma^2 + t) is 0.246, 0.47, 1: the gain is that of the operator in use
    assert norm_and_condition(a, damped) == pytest.approx((1.0, 8.0))
