"""The norm in which the training equations of the element sampling are measured."""

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.subspace.ecsw import training_run
from pdrom.reduction.subspace.local_step import SubspaceLocalStep
from pdrom.reduction.subspace.model import make_columns, sample_elements
from pdrom.reduction.subspace.space import ReducedSpace

FRAME = 5


@pytest.fixture
def hanging():
    """A sheet that hangs from a side, in a subspace, and its stiffness and mass there."""
    scene = make_scene(
        {"effect": "gravity"}, {"effect": "pins", "select": "left"},
        {"effect": "spring", "weight": 1e4},
        mesh={"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}, frames=100,
    )  # fmt: skip
    columns = make_columns(scene, trajectory(scene)[1:], "pod", 6)
    steps = [SubspaceLocalStep(group, columns) for group in scene.groups]
    space = ReducedSpace(scene, columns, [step.matrix for step in steps])
    fixed = space.fixed(FRAME, columns.B.T @ scene.mesh.points)[0]
    return scene, columns, space, fixed


def test_the_energy_norm_is_that_of_the_inverse_matrix(hanging, rng):
    scene, columns, space, fixed = hanging
    (frame,) = training_run(scene, columns, [FRAME])
    free = np.setdiff1d(np.arange(len(space.matrix)), fixed)
    r = rng.standard_normal(len(free))
    expected = r @ np.linalg.solve(space.matrix[np.ix_(free, free)], r)
    assert np.sum((frame.measure[:, free] @ r) ** 2) == pytest.approx(expected)


def test_the_response_norm_is_the_root_mean_square_of_the_recursion(hanging):
    """Reference: the squares of the recursion's answer to one impulse, added up, mode by mode."""
    scene, columns, space, fixed = hanging
    (frame,) = training_run(scene, columns, [FRAME], norm="response")
    free = np.setdiff1d(np.arange(len(space.matrix)), fixed)
    block = np.ix_(free, free)
    a, mass = space.matrix[block], space.inertia_matrix[block]  # M + h^2 K and M, over h^2
    step = np.linalg.inv(a)
    r = np.eye(len(free))
    now, before, total = step @ r, np.zeros_like(r), np.zeros_like(r)
    for _ in range(3000):
        total += now.T @ mass @ now
        now, before = step @ mass @ (2.0 * now - before), now
    measured = frame.measure[:, free].T @ frame.measure[:, free]
    np.testing.assert_allclose(measured, total, rtol=1e-6, atol=1e-9 * np.abs(total).max())


@pytest.mark.parametrize("norm", ["energy", "response"])
def test_samples_meet_a_tolerance_in_either_norm(hanging, norm):
    scene, columns, _, _ = hanging
    coarse, fine = sample_elements(scene, columns, np.arange(0, 100, 5), [0.3, 1e-3], norm=norm)
    assert 0 < len(coarse["spring"].elements) <= len(fine["spring"].elements)
    assert (fine["spring"].factors > 0.0).all()
