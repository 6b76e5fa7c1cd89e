"""S-OPT against dense determinants and the best subset."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdrom.core.errors import SamplingError
from pdrom.reduction.sampling.s_opt import SOpt, s_opt_path

SIZES = st.tuples(
    st.integers(2, 20), st.sampled_from([1, 3, 6]), st.integers(1, 9), st.integers(0, 2**32 - 1)
).filter(lambda s: s[2] <= s[0] * s[1])
extend = SOpt().extend
KINDS = ("orthonormal", "scaled", "dependent")


def modes(size: tuple[int, int, int, int], kind: str = "orthonormal") -> np.ndarray:
    """Random modes (rows * elements, r): orthonormal, of unlike lengths, nearly dependent."""
    elements, rows, r, seed = size
    v = np.random.default_rng(seed).standard_normal((elements * rows, r))
    if kind == "scaled":
        return v * 10.0 ** -np.arange(r)
    if kind == "dependent":
        return v[:, :1] + 1e-3 * v
    return np.linalg.qr(v)[0]


def s_opt(v: np.ndarray, size: int, count: int | None = None) -> np.ndarray:
    """Select one element a mode, then further ones up to ``count``."""
    return extend(v, size, s_opt_path(v, size), v.shape[1] if count is None else count)


def measure(v: np.ndarray, size: int, elements, columns: int | None = None) -> float:
    """S(A) = (sqrt(det A^T A) / prod_j |A_j|)^(1/r) of the first columns A_j at the elements."""
    a = v.reshape(-1, size, v.shape[1])[list(elements), :, :columns]
    a = a.reshape(len(elements) * size, -1)
    norms = np.linalg.norm(a, axis=0)
    if a.shape[0] < a.shape[1] or not norms.all():
        return 0.0
    logarithm = np.linalg.slogdet((a / norms).T @ (a / norms))[1]
    return float(min(np.exp(0.5 * logarithm / a.shape[1]), 1.0))


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None)
@given(size=SIZES)
def test_each_element_maximises_the_s_opt_measure(kind, size):
    """Reference: in every step, the determinant for each remaining element."""
    v = modes(size, kind)
    before = v.copy()
    count = min(size[0], 2 * size[2])  # all elements, if there are fewer of them than modes
    picked = s_opt(v, size[1], count).tolist()
    np.testing.assert_array_equal(v, before)
    assert len(set(picked)) == len(picked) == count
    first = np.sum(v[:, 0].reshape(size[0], size[1]) ** 2, axis=1)
    assert first[picked[0]] == pytest.approx(first.max())
    for k in range(1, count):
        columns = min(k + 1, size[2])
        left = [e for e in range(size[0]) if e not in picked[:k]]
        best = max(measure(v, size[1], [*picked[:k], e], columns) for e in left)
        assert measure(v, size[1], picked[: k + 1], columns) == pytest.approx(best, rel=1e-6)


@settings(deadline=None)
@given(SIZES)
def test_selections_of_one_element_a_mode_are_nested_and_can_be_extended(size):
    v = modes(size)
    path = s_opt_path(v, size[1])
    assert len(path) == min(size[0], size[2])
    for r in range(1, len(path)):
        np.testing.assert_array_equal(s_opt_path(v[:, :r], size[1]), path[:r])
    more = extend(v, size[1], path, size[2] + 2)
    np.testing.assert_array_equal(more[: len(path)], path)
    assert len(more) == min(size[0], size[2] + 2)
    np.testing.assert_array_equal(extend(v, size[1], path, 1), path)


def test_rank_updates_stay_accurate_over_many_steps():
    """After 120 rank-s updates, determinants select the same next element."""
    v = modes((150, 3, 60, 7), "scaled")
    picked = s_opt(v, 3, 120).tolist()
    left = [e for e in range(150) if e not in picked[:-1]]
    best = max(measure(v, 3, [*picked[:-1], e]) for e in left)
    assert measure(v, 3, picked) == pytest.approx(best, rel=1e-9)


def test_bases_without_a_selection_are_refused(rng):
    v = rng.standard_normal((30, 4))
    with pytest.raises(SamplingError, match="depend on each other at the 1 sampled"):
        extend(v, 3, np.array([0]), 6)
    v[:, 2] = 0.0
    with pytest.raises(SamplingError, match="mode 3 is zero"):
        s_opt(v, 3)


@pytest.mark.parametrize("rows", [1, 3, 6])
@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    r=st.integers(2, 9),
    exponent=st.one_of(st.none(), st.floats(-18.0, -15.0), st.floats(-9.0, 0.0)),
)
def test_modes_are_dependent_below_a_threshold_with_a_margin_on_both_sides(rows, seed, r, exponent):
    """The last mode is a combination of the others up to 10^exponent."""
    rng = np.random.default_rng(seed)
    v = np.linalg.qr(rng.standard_normal((20 * rows, r)))[0]
    beside = 0.0 if exponent is None else 10.0**exponent
    v[:, -1] = v[:, :-1] @ rng.choice([-1.0, 0.5, 1.0], r - 1) + beside * v[:, -1]
    if beside < 1e-12:
        with pytest.raises(SamplingError, match=r"depend|independent"):
            s_opt(v, rows)
    else:
        assert len(set(s_opt(v, rows, 12).tolist())) == 12
