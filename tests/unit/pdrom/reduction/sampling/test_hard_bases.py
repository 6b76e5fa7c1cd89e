"""Every method of the study on snapshots that are tiny, constant, or of very different sizes."""

import numpy as np
import pytest

from pdrom.core.errors import RankError
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import load_methods
from pdrom.reduction.sampling import Reduction, select
from places import ROOT

METHODS = load_methods(ROOT / "config" / "methods.yaml")
FRAMES, ELEMENTS, ROWS = 9, 14, 2
EPS = np.finfo(float).eps


def low_rank(rng: np.random.Generator, rank: int) -> np.ndarray:
    """Snapshots (9, 28, 3) of rank ``rank`` with sizes of order one."""
    modes = rng.standard_normal((rank, ELEMENTS * ROWS * 3))
    return (rng.standard_normal((FRAMES, rank)) @ modes).reshape(FRAMES, -1, 3)


# name -> snapshots and their largest rank (an affine mean reduces it by at most one)
SNAPSHOTS = {
    "zero": (lambda rng: np.zeros((FRAMES, ELEMENTS * ROWS, 3)), 0),
    "constant": (lambda rng: np.repeat(low_rank(rng, 4)[:1], FRAMES, axis=0), 1),
    "repeated": (lambda rng: low_rank(rng, 5)[[0, 1] * 4 + [0]], 2),
    "rank one": (lambda rng: low_rank(rng, 1), 1),
    "rank three": (lambda rng: low_rank(rng, 3), 3),
    "full": (lambda rng: low_rank(rng, FRAMES), FRAMES),
    "tiny": (lambda rng: 1e-14 * low_rank(rng, 3), 3),
    "denormal": (lambda rng: 1e-310 * low_rank(rng, 3), FRAMES),
    "huge": (lambda rng: 1e140 * low_rank(rng, 3), 3),
    "flat axis": (lambda rng: low_rank(rng, 3) * [1.0, 1.0, 0.0], 3),
    "twin elements": (lambda rng: low_rank(rng, 3)[:, [0, 1, *range(ELEMENTS * ROWS - 2)]], 3),
    # half of the elements are twelve decades larger
    "ill-scaled": (lambda rng: low_rank(rng, 3) * np.repeat([1e12, 1.0], ELEMENTS)[:, None], 3),
    "one sign": (lambda rng: 1.0 + 1e-9 * low_rank(rng, 2), 3),
}


EXACT = ("pod", "deim", "qdeim", "block-deim", "block-qdeim", "gappy")
REPRODUCED = ("repeated", "rank one", "rank three", "full", "tiny", "huge", "twin elements")


def basis_of(p: np.ndarray, method: str, roundoff: float | None = None):
    """Basis with the rounding errors of stored numbers, unless a level is given."""
    roundoff = EPS * float(np.linalg.norm(p)) if roundoff is None else roundoff
    return compute_basis(p, np.ones(p.shape[1]), roundoff, ROWS, METHODS[method])


@pytest.mark.parametrize("name", SNAPSHOTS)
@pytest.mark.parametrize("method", METHODS)
def test_a_basis_spans_its_data_and_reports_its_deim_constant(name, method, rng):
    """The numerical rank never exceeds the rank of the data, and V has no further columns.

    Up to the rank a DEIM constant is reported; where it is finite, so is the reconstruction. At
    the rank the methods `EXACT` reproduce the data `REPRODUCED`. Larger sizes are a named error,
    and data below their rounding errors have no basis.
    """
    make, rank = SNAPSHOTS[name]
    p, spec = make(rng), METHODS[method]
    basis = basis_of(p, method)
    assert basis.rank <= rank
    assert basis.V.shape[1] == basis.rank
    assert np.isfinite(basis.V).all()
    assert np.isfinite(basis.mean).all()
    for r in range(1, basis.rank + 1):
        reduction = Reduction(basis, select(basis, spec, r), spec, r)
        # a single axis of an orthonormal basis may have less than one mode
        assert not np.isnan(reduction.gain)
        assert reduction.gain > 0.0
        if np.isfinite(reduction.gain):
            assert np.isfinite(reduction.reconstruct(p)).all()
        if r == basis.rank and method in EXACT and name in REPRODUCED:
            error = np.linalg.norm(reduction.reconstruct(p) - p) / np.linalg.norm(p)
            assert error <= 100.0 * EPS * reduction.gain
    for r in (0, basis.rank + 1, 10**6):
        with pytest.raises(RankError, match=f"r = {r}, .* numerical rank {basis.rank}"):
            select(basis, spec, r)
    assert basis_of(p, method, roundoff=2.0 * np.linalg.norm(p) + 1e-300).rank == 0
