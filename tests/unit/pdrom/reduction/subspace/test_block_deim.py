"""Block DEIM in a position subspace: training, gain, refusal, and what mends its runs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from builders import make_scene
from pdrom.core.errors import SamplingError, SnapshotError
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.snapshots import training_frames
from pdrom.reduction.subspace.block_deim import block_deim, train_basis
from pdrom.reduction.subspace.interpolated import Training, interpolate
from pdrom.reduction.subspace.model import SubspaceModel, make_columns
from pdrom.reduction.subspace.rerun import rerun_model
from pdrom.reduction.subspace.space import coordinates
from pdrom.reduction.subspace.specs import InterpolationSpec


@pytest.fixture(scope="module")
def pulled():
    """A sheet that hangs and swings out of its plane, its run, and a snapshot basis."""
    scene = make_scene(
        {"effect": "strain", "weight": 1e6},
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        mesh={"kind": "cloth", "rows": 9, "columns": 8, "plane": "xz"},
        frames=80,
    )
    run = trajectory(scene)
    return scene, run, make_columns(scene, run[1::2], "pod", 8)


def run_error(scene, run, columns, found) -> float:
    difference = rerun_model(scene, SubspaceModel("pod", columns, found), run).difference
    return float(np.linalg.norm(difference) / np.linalg.norm(run - run[0]))


def test_what_mends_it(pulled):
    """Visited states and oversampling together, not one of them, reach the full projections."""
    scene, run, columns = pulled
    training = Training(scene, columns, run[1::2])

    def error(**changes) -> float:
        found = interpolate(scene, columns, training, InterpolationSpec(modes=15, **changes))
        return run_error(scene, run, columns, found)

    full = run_error(scene, run, columns, {})
    assert full < 0.02
    assert error(states="visited", oversampling=3) < 1.5 * full
    assert error(states="visited", oversampling=3, margin=0.1) < 1.5 * full
    for one in ({}, {"states": "visited"}, {"oversampling": 3}):
        assert error(**one) > 4.0 * full
    # without the strain that is already there, nothing pulls an unseen deformation back
    assert error(interpolates="residual") > 0.5


def test_visited_states_are_last_iterates_of_the_training_frames(pulled):
    scene, run, columns = pulled
    states = Training(scene, columns, run[1::2]).states("visited")
    frames = training_frames(scene.config.frames, len(run[1::2]))
    assert len(states) == len(set(frames.tolist()))
    loop, state = SubspaceModel("pod", columns).loop(scene)
    first = []
    loop.step(state, 0, on_last_iterate=lambda y: first.append(columns.B @ y))
    assert frames[0] == 0
    np.testing.assert_allclose(states[0][0], columns.B @ state.positions, atol=1e-14)
    np.testing.assert_array_equal(states[0][1], first[0])
    for start, y in states:
        for field in (start, y):
            inside = columns.B @ coordinates(columns, scene.masses, field)
            np.testing.assert_allclose(inside, field, atol=1e-10)


def test_projected_states_lie_in_the_subspace_and_full_order_ones_are_the_runs(pulled):
    scene, run, columns = pulled
    training = Training(scene, columns, run[1::2])
    np.testing.assert_array_equal(training.states("full-order")[3][1], run[1::2][3])
    inside = training.states("projected")[3][1]
    rest = run[1::2][3] - inside
    assert np.linalg.norm(columns.B.T @ (scene.masses[:, None] * rest)) < 1e-8
    assert training.states("visited") is training.states("visited")


@settings(max_examples=15)
@given(seed=st.integers(0, 2**31), modes=st.integers(1, 8), bound=st.floats(1.05, 6.0))
def test_gain_bound_holds_and_bounds_the_error(pulled, seed, modes, bound):
    """|| p - p^ || <= gain || (I - V V^T) p ||, and the gain is not above the bound asked for."""
    scene, run, columns = pulled
    group, rng = scene.groups[0], np.random.default_rng(seed)
    spec = InterpolationSpec(modes=modes, gain=bound)
    basis = train_basis(group, [(q, q) for q in run[1::2]], spec)
    found = block_deim(group, columns, basis, spec)
    assert found.gain <= bound * (1.0 + 1e-12)
    assert len(np.unique(found.elements)) == len(found.elements) >= modes
    V = basis.V[:, :modes]
    p = rng.standard_normal(len(V))
    size = 3 * group.rows_per_element
    entries = (found.elements[:, None] * size + np.arange(size)).ravel()
    error = np.linalg.norm(p - V @ (found.operator @ p[entries]))
    assert error <= found.gain * np.linalg.norm(p - V @ (V.T @ p)) * (1.0 + 1e-9)


def test_training_snapshots_are_reproduced_at_full_rank(pulled):
    scene, run, columns = pulled
    group = scene.groups[0]
    for changes in ({}, {"centring": "affine"}, {"interpolates": "residual"}):
        spec = InterpolationSpec(modes=1000, **changes)
        basis = train_basis(group, [(q, q) for q in run[1:12]], spec)
        found = block_deim(group, columns, basis, spec)
        size = 3 * group.rows_per_element
        entries = (found.elements[:, None] * size + np.arange(size)).ravel()
        p = basis.snapshots - basis.mean
        again = p[:, entries] @ found.operator.T @ basis.V.T
        np.testing.assert_allclose(again, p, atol=1e-8 * np.abs(p).max())


def test_a_basis_with_a_large_gain_is_refused(pulled):
    scene, run, columns = pulled
    group = scene.groups[0]
    plain = InterpolationSpec(modes=8)
    basis = train_basis(group, [(q, q) for q in run[1:]], plain)
    gain = block_deim(group, columns, basis, plain).gain
    kept = plain.model_copy(update={"refuse_above": 1.01 * gain})
    assert block_deim(group, columns, basis, kept).gain == gain
    refused = plain.model_copy(update={"refuse_above": 1.0 + 0.5 * (gain - 1.0)})
    with pytest.raises(SamplingError, match=r"'strain': gain .* of 8 elements, allowed are"):
        block_deim(group, columns, basis, refused)


def test_no_states_are_an_error(pulled):
    scene, _, _ = pulled
    with pytest.raises(SnapshotError, match="'strain': no training states"):
        train_basis(scene.groups[0], [], InterpolationSpec())


@pytest.mark.parametrize(
    "settings",
    [
        {"test": "interpolated", "centring": "affine"},
        {"interpolates": "both", "margin": 0.1},
        {"gain": 1.0},
        {"modes": 0},
        {"margin": -0.1},
        {"states": "held-out"},
        {"overampling": 3},
    ],
    ids=str,
)
def test_impossible_settings_are_refused(settings):
    with pytest.raises(ValidationError, match=next(iter(settings))):
        InterpolationSpec(**settings)
