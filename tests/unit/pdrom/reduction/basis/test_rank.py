"""Numerical rank: the relative level of the SVD and the absolute level of the data."""

import numpy as np
import pytest

from pdrom.reduction.basis.pod import numerical_rank

EPS = np.finfo(float).eps


@pytest.mark.parametrize(
    ("sigma", "shape", "roundoff", "rank"),
    [
        ([], (10, 0), 0.0, 0),
        ([0.0, 0.0], (10, 2), 0.0, 0),
        ([3.0, 2.0, 1.0], (10, 3), 0.0, 3),
        ([3.0, 2.0, 1.0], (10, 3), 1.5, 2),
        ([3.0, 2.0, 1.0], (10, 3), 5.0, 0),
        # on a level is not above it
        ([3.0, 2.0, 1.0], (10, 3), 2.0, 1),
        ([1.0, 11 * EPS, 9 * EPS], (10, 3), 0.0, 2),
        ([1.0, 11 * EPS, 9 * EPS], (3, 10), 0.0, 2),
        ([1.0, 11 * EPS, 9 * EPS], (8, 8), 0.0, 3),
    ],
)
def test_counts_what_is_above_both_levels(sigma, shape, roundoff, rank):
    assert numerical_rank(np.array(sigma), shape, roundoff) == rank


def test_noise_that_decays_nicely_has_no_rank(rng):
    """A flat sheet's bending: singular values near 1e-12 and nothing but cancellation."""
    sigma = np.linalg.svd(1e-13 * rng.standard_normal((300, 20)), compute_uv=False)
    assert numerical_rank(sigma, (300, 20), 1e-10) == 0
    assert numerical_rank(sigma, (300, 20), 0.0) == 20
