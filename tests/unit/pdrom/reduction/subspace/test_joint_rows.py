"""Joint rows in a subspace: the reduction of the full order, multiplied out."""

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.reduction import Reduction
from pdrom.reduction.sampling.select import select
from pdrom.reduction.subspace.interpolation import InterpolatedLocalStep
from pdrom.reduction.subspace.joint import interpolation_of
from pdrom.reduction.subspace.model import make_columns

R = 4


@pytest.mark.parametrize(
    "choices",
    [
        {"rows": "joint", "centring": "none", "solve": "square"},
        {"rows": "element", "centring": "affine"},
    ],
    ids=["joint rows", "whole elements"],
)
def test_the_right_hand_side_is_that_of_the_reconstruction(choices):
    pull, pins = {"effect": "gravity"}, {"effect": "pins", "select": "left"}
    scene = make_scene(pull, pins, {"effect": "strain", "weight": 1e4}, mesh=GROUPS["strain"])
    (group,) = scene.groups
    run = trajectory(scene, track_objective=False)
    snapshots = np.stack([group.project(q) for q in run])
    spec = MethodSpec(title="x", **choices)
    basis = compute_basis(snapshots, np.ones(len(group.row_weights)), 1e-12, 2, spec)
    reduction = Reduction(basis, select(basis, spec, R), spec, R)
    columns = make_columns(scene, run, "pod", 3)
    step = InterpolatedLocalStep(group, columns, interpolation_of(group, columns, reduction))
    z = np.random.default_rng(0).standard_normal((columns.B.shape[1], 3))
    rhs = np.zeros_like(z)
    step.accumulate(z, rhs)
    p = reduction.reconstruct(group.project(columns.B @ z)[None])[0]
    strain = group.S @ columns.B
    assert rhs == pytest.approx(strain.T @ (group.row_weights[:, None] * p), rel=1e-9, abs=1e-9)
