"""Reruns: equal to the full-order run where nothing is lost, and ended where they blow up."""

import numpy as np
import pytest

from builders import TOP, Pushing, make_scene
from pdrom.core.errors import SceneError
from pdrom.model.runs import trajectory
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import load_methods
from pdrom.reduction.rerun import Rerun, displacement_norms, step_norms
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group, rerun
from places import CONFIG

PRESETS = load_methods(CONFIG / "methods.yaml")
EFFECTS = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}, TOP


def scene_with(*groups: str, frames: int = 4, **settings):
    effects = [{"effect": name, "weight": 1e4} for name in groups]
    return make_scene(*EFFECTS, *effects, frames=frames, iterations=3, **settings)


class Watched:
    """A group that keeps the projections of every iterate."""

    def __init__(self, group) -> None:
        self.group, self.name, self.seen = group, group.name, []

    def begin_frame(self, q):
        self.group.begin_frame(q)

    def accumulate(self, y, rhs):
        self.seen.append(self.group.project(y))
        return self.group.accumulate(y, rhs)


@pytest.mark.parametrize("group", ["spring", "strain"])
def test_basis_of_all_iterates_reruns_the_full_order_run(group):
    """Every projection is in the span, so that the orthogonal projection changes nothing."""
    scene = scene_with("spring", "strain")
    watched = Watched(scene.group(group))
    reference = trajectory(scene, local_steps=replace_group(scene, group, watched))
    snapshots = np.stack(watched.seen)
    assert len(snapshots) == 12
    chosen = scene.group(group)
    masses = np.ones(snapshots.shape[1])
    for method in ("pod", "qdeim", "block-qdeim"):
        spec = PRESETS[method]
        basis = compute_basis(snapshots, masses, 0.0, chosen.rows_per_element, spec)
        r = basis.rank
        reduction = Reduction(basis, select(basis, spec, r), spec, r)
        steps = replace_group(scene, group, ReducedLocalStep(chosen, reduction))
        result = rerun(scene, scene.system, steps, reference, 10.0)
        assert result.blowup_frame is None
        assert result.frames == scene.config.frames
        motion = np.linalg.norm(displacement_norms(reference))
        assert np.linalg.norm(result.difference) < 1e-10 * reduction.gain * motion


def test_full_local_steps_repeat_the_run_to_the_bit():
    scene = scene_with("spring", "strain")
    reference = trajectory(scene)
    result = rerun(scene, scene.system, scene.groups, reference, 10.0)
    np.testing.assert_array_equal(result.positions, reference)
    np.testing.assert_array_equal(result.difference, np.zeros(4))
    extent = np.ptp(reference[1:], axis=1).max(axis=1) / scene.mesh.extent
    np.testing.assert_allclose(result.extent, extent, rtol=1e-14)
    assert result.max_extent == extent.max()


def test_growth_beyond_the_limit_ends_the_run_with_its_last_frame():
    scene = scene_with("spring", frames=30)
    reference = trajectory(scene)
    push = np.linspace(-2e5, 2e5, scene.mesh.vertices)[:, None] * [1.0, 0.0, 0.0]
    whole = rerun(scene, scene.system, [Pushing(lambda: push)], reference, np.inf)
    assert (whole.blowup_frame, whole.frames) == (None, 30)
    limit = float(np.median(whole.extent))
    result = rerun(scene, scene.system, [Pushing(lambda: push)], reference, limit)
    first = int(np.flatnonzero(whole.extent > limit)[0])
    assert 0 < first < 29
    assert result.blowup_frame == first
    assert result.frames == first + 1 == len(result.extent)
    np.testing.assert_array_equal(result.positions, whole.positions[: first + 2])
    np.testing.assert_array_equal(result.difference, whole.difference[: first + 1])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e308])
def test_numbers_that_are_none_end_the_run_before_them(bad):
    scene = scene_with("spring")
    result = rerun(scene, scene.system, [Pushing(lambda: bad)], trajectory(scene), 2.0)
    assert result.blowup_frame == 0
    assert np.isfinite(result.positions).all()
    assert result.frames <= 1


def test_an_empty_run_has_no_extent():
    none, start = np.array([]), np.zeros((1, 3, 3))
    run = Rerun(start, none, none, 0, start)
    assert (run.frames, run.max_extent) == (0, 0.0)


def test_replaced_group_keeps_the_others_and_their_order():
    scene = scene_with("spring", "strain")
    other = Pushing(lambda: 0.0)
    steps = replace_group(scene, "spring", other)
    assert [s is g for s, g in zip(steps, scene.groups, strict=True)] == [False, True]
    assert steps[0] is other
    assert scene.groups[0] is not other
    with pytest.raises(SceneError, match=r"no group 'bending' \(spring, strain\)"):
        replace_group(scene, "bending", other)


def test_steps_are_those_of_the_velocities():
    """What a vertex moves in a frame is the time step times the velocity that the loop has then."""
    scene = scene_with("spring", "strain")
    loop, state = scene.stepper(scene.system, scene.groups), scene.initial_state()
    positions, speeds = [state.positions], []
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame)
        positions.append(state.positions)
        speeds.append(np.linalg.norm(state.velocities))
    expected = scene.config.time_step * np.array(speeds)
    assert (expected > 0.0).all()
    np.testing.assert_allclose(step_norms(np.stack(positions)), expected, rtol=1e-12)
    assert len(step_norms(np.zeros((1, 2, 3)))) == 0


def test_displacement_norms_by_hand():
    reference = np.zeros((3, 2, 3))
    reference[1:, 0, 0], reference[2, 1, 2] = 3.0, 4.0
    assert displacement_norms(reference).tolist() == [3.0, 5.0]
    assert displacement_norms(reference + 7.0).tolist() == [3.0, 5.0]
