"""Coefficients kept in the range of the training snapshots."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select
from strategies import SEEDS

ELEMENTS, P, R = 14, 2, 4
FREE = MethodSpec(title="t", centring="affine", rows="element")


def reductions(seed: int, **changes) -> tuple[np.ndarray, Reduction, Reduction]:
    """Training snapshots, and one method without and with bounds."""
    rng = np.random.default_rng(seed)
    p = rng.standard_normal((9, ELEMENTS * P, 3)) + 2.0
    mass = rng.uniform(0.5, 2.0, ELEMENTS * P)
    free = FREE.model_copy(update=changes)
    bounded = free.model_copy(update={"bounds": "training"})
    basis = compute_basis(p, mass, 0.0, P, free)
    sampling = select(basis, free, R)
    return p, Reduction(basis, sampling, free, R), Reduction(basis, sampling, bounded, R)


def coefficients(reduction: Reduction, p: np.ndarray) -> np.ndarray:
    """Coefficients of reconstructions (n, R), orthonormal modes."""
    return (reduction.reconstruct(p).reshape(len(p), -1) - reduction.basis.mean) @ reduction.v


@given(SEEDS, st.floats(0.0, 1.0))
def test_range_is_that_of_the_training_coefficients_with_its_margin(seed, margin):
    p, _, bounded = reductions(seed, margin=margin)
    own = (p.reshape(len(p), -1) - bounded.basis.mean) @ bounded.v
    low, high = own.min(axis=0), own.max(axis=0)
    extra = margin * (high - low)
    far = np.full((2, R), 1e9) * [[-1.0], [1.0]]
    np.testing.assert_allclose(bounded.limited(far), [low - extra, high + extra], atol=1e-9)
    np.testing.assert_allclose(bounded.limited(own), own, atol=1e-9)


@settings(max_examples=5)
@given(SEEDS)
def test_clipping_is_the_projection_on_the_box(seed):
    """Against scipy's bounded least squares min |V c - p^| with the same limits."""
    _, free, bounded = reductions(seed)
    unseen = 5.0 * np.random.default_rng(seed + 1).standard_normal((3, ELEMENTS * P, 3))
    limits = bounded.limited(np.full((2, R), 1e9) * [[-1.0], [1.0]])
    target = free.reconstruct(unseen).reshape(3, -1) - free.basis.mean
    found = coefficients(bounded, unseen)
    for b, c in zip(target, found, strict=True):
        np.testing.assert_allclose(c, lsq_linear(free.v, b, limits, tol=1e-12).x, atol=1e-5)


@given(SEEDS)
def test_it_cannot_hurt_where_the_best_coefficients_are_in_range(seed):
    """Training snapshots with noise at the sampled entries only."""
    p, free, bounded = reductions(seed, margin=0.0)
    noise = 10.0 * np.random.default_rng(seed + 2).standard_normal(p.shape)
    best = (p.reshape(len(p), -1) - free.basis.mean) @ free.v
    before = np.abs(coefficients(free, p + noise) - best)
    after = np.abs(coefficients(bounded, p + noise) - best)
    assert (after <= before + 1e-9).all()
    assert after.sum() < before.sum()


def test_wild_samples_give_a_bounded_reconstruction(rng):
    _, free, bounded = reductions(3)
    wild = 1e12 * rng.standard_normal((2, ELEMENTS * P, 3))
    assert np.abs(free.reconstruct(wild)).max() > 1e9
    assert np.abs(bounded.reconstruct(wild)).max() < 1e3


def test_methods_without_bounds_return_the_same_array():
    _, free, _ = reductions(1)
    c = np.ones(R)
    assert free.limited(c) is c
