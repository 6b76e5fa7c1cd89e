"""Selections against pyMOR on bases that are hard to interpolate, and their bounds on the gain."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymor.algorithms.ei import deim
from pymor.vectorarrays.numpy import NumpyVectorSpace

from pdrom.reduction.sampling.deim import deim_entries
from pdrom.reduction.sampling.qdeim import qdeim_elements

SIZES = st.tuples(st.integers(2, 60), st.integers(1, 12)).filter(lambda s: s[1] <= s[0])


def bases(n: int, r: int, seed: int, kind: str) -> np.ndarray:
    """Bases (n, r): random, of localised modes, decaying before orthonormalisation, not orthonormal
    with columns that nearly depend on each other."""
    rng = np.random.default_rng(seed)
    v = rng.standard_normal((n, r))
    if kind == "local":
        v *= np.exp(-0.5 * (np.linspace(0, r, n)[:, None] - np.arange(r)) ** 2)
    if kind == "decaying":
        v = v @ np.triu(rng.standard_normal((r, r))) * 10.0 ** -np.arange(r)
    if kind == "dependent":
        return v[:, :1] + 1e-5 * v
    return np.linalg.qr(v)[0]


KINDS = ["random", "local", "decaying", "dependent"]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=40, deadline=None)
@given(size=SIZES, seed=st.integers(0, 2**31))
def test_entries_are_those_of_pymor(kind, size, seed):
    v = bases(*size, seed, kind)
    theirs = deim(NumpyVectorSpace.from_numpy(v), pod=False)[0]
    np.testing.assert_array_equal(deim_entries(v), theirs)


BOUNDS = {
    # Drmac and Gugercin 2016, theorem 2.1
    "q-deim": lambda n, r: np.sqrt(n - r + 1) * np.sqrt(4.0**r + 6 * r - 1) / 3,
    # Sorensen and Embree 2016, lemma 4.4
    "deim": lambda n, r: np.sqrt(n * r / 3) * 2.0**r,
}


@pytest.mark.parametrize("method", BOUNDS)
@pytest.mark.parametrize("kind", ["random", "local", "decaying"])
@settings(max_examples=40, deadline=None)
@given(size=SIZES, seed=st.integers(0, 2**31))
def test_gain_is_below_its_bound(method, kind, size, seed):
    v = bases(*size, seed, kind)
    entries = deim_entries(v) if method == "deim" else qdeim_elements(v, 1)
    gain = 1.0 / np.linalg.svd(v[entries], compute_uv=False)[-1]
    assert 1.0 - 1e-12 <= gain <= BOUNDS[method](*size) * (1 + 1e-9)
