"""Oversampling of element blocks, and the ladder's combinations."""

import numpy as np
import pytest

from conftest import ROOT
from pdrom.basis import compute_basis
from pdrom.ladder import load_ladder
from pdrom.sampling import Reduction, select
from pdrom.sampling.block import block_elements
from pdrom.sampling.oversample import extend_elements

LADDER = load_ladder(ROOT / "config" / "ladder.yaml")


def orthonormal(rng, n, r):
    return np.linalg.qr(rng.standard_normal((n, r)))[0]


def test_more_elements_never_raise_the_gain(rng):
    """sigma_min of the sampled rows can only grow when rows are added (interlacing)."""
    v = orthonormal(rng, 6 * 40, 8)
    first = block_elements(v, 6)
    path = extend_elements(v, 6, first, 30)
    assert path[: len(first)].tolist() == first.tolist()
    assert len(set(path.tolist())) == 30
    blocks = v.reshape(40, 6, 8)
    smallest = [
        np.linalg.svd(blocks[path[:m]].reshape(-1, 8), compute_uv=False)[-1] for m in range(8, 31)
    ]
    assert (np.diff(smallest) >= -1e-14).all()
    assert smallest[-1] > 1.5 * smallest[0]


def test_weakest_direction_beats_random_elements(rng):
    """Compared with the median of random extensions of the same size."""
    v = orthonormal(rng, 6 * 60, 10) * np.linspace(0.2, 2.0, 10)
    first = block_elements(v, 6)
    blocks = v.reshape(60, 6, 10)

    def smallest(elements):
        return np.linalg.svd(blocks[elements].reshape(-1, 10), compute_uv=False)[-1]

    others = np.setdiff1d(np.arange(60), first)
    drawn = [smallest([*first, *rng.permutation(others)[:10]]) for _ in range(50)]
    assert smallest(extend_elements(v, 6, first, 20)) > np.median(drawn)


def test_it_ends_when_every_element_is_taken(rng):
    v = orthonormal(rng, 6 * 5, 3)
    assert sorted(extend_elements(v, 6, block_elements(v, 6), 99).tolist()) == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("direction", ["up", "down"])
def test_every_rung_reproduces_what_is_in_its_space(direction, rng):
    """Each rung's operator is exact on its own affine space, as long as it is no Tikhonov solve."""
    snapshots = rng.standard_normal((12, 40, 3))
    for method in getattr(LADDER, direction):
        basis = compute_basis(snapshots, np.ones(40), 0.0, 2, method)
        reduction = Reduction(basis, select(basis, method, 5), method, 5)
        assert np.isfinite(reduction.gain)
        if method.solve == "tikhonov":
            continue
        axes = 3 if method.per_axis else 1
        space = reduction.v.reshape(40, 3, 5) * rng.standard_normal((axes, 5))
        p = basis.mean.reshape(40, 3) + space.sum(axis=2)
        assert reduction.reconstruct(p[None])[0] == pytest.approx(p, abs=1e-8 * reduction.gain)


def test_rungs_change_one_ingredient_at_a_time():
    """Between two rungs of `up` differ at most the fields that one ingredient is made of."""
    for lower, upper in zip(LADDER.up[:-1], LADDER.up[1:], strict=True):
        a, b = lower.model_dump(exclude={"title"}), upper.model_dump(exclude={"title"})
        changed = {key for key in a if a[key] != b[key]}
        assert (changed - {"coefficients"} and len(changed - {"coefficients"}) <= 1) or changed == {
            "coefficients"
        }


def test_signs_repeat_the_published_rung():
    signs = [row for row in LADDER.rungs() if row[0] == "signs"]
    assert len(signs) == LADDER.signs >= 5
    assert all(method == LADDER.up[0] for _, method, _ in signs)
