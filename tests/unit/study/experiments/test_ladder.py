"""The ladder's combinations."""

import numpy as np
import pytest

from pdrom.core.yamlfile import read_yaml
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.sampling import Reduction, select
from places import ROOT
from study.experiments.repetitions import LadderSection

LADDER = LadderSection(**read_yaml(ROOT / "config" / "default.yaml")["ladder"])


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


@pytest.mark.parametrize("p", [1, 2, 3])
def test_the_square_samples_as_many_entries_in_each_of_its_places(p, rng):
    snapshots = rng.standard_normal((12, 20 * p, 3))
    entries = set()
    for direction, method, _, _ in LADDER.rungs(p):
        if direction == "square":
            basis = compute_basis(snapshots, np.ones(20 * p), 0.0, p, method)
            reduction = Reduction(basis, select(basis, method, 5), method, 5)
            entries.add(sum(len(block.entries) for block in reduction.blocks))
    assert entries == {3 * p * 5}


def test_signs_repeat_the_published_rung():
    signs = [row for row in LADDER.rungs(2) if row[0] == "signs"]
    assert len(signs) == LADDER.signs >= 5
    assert all(method == LADDER.up[0] for _, method, _, _ in signs)
