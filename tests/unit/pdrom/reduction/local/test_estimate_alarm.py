"""A guard that listens to the estimated error of the run."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from builders import make_scene
from pdrom.core.errors import ConfigurationError
from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.local.estimate_alarm import EstimateAlarm
from pdrom.reduction.local.guard import GuardRecord
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.guarded import Trained, guarded_rerun
from pdrom.reduction.method import load_methods
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.subspace import companion as companions
from pdrom.reduction.subspace.companion import (
    CompanionSpec,
    RunningEstimate,
    companion_model,
    companion_run,
)
from places import CONFIG

FRAMES = 14
REPORT = FrameReport(np.empty(0), np.zeros(4))


@dataclass(frozen=True)
class Case:
    """A sheet whose handle is moved and whose springs are reduced badly, and an auxiliary model."""

    scene: Scene
    reference: np.ndarray
    reduction: Reduction
    trained: Trained

    def run(self, **asked) -> tuple[Rerun, GuardRecord]:
        return guarded_rerun(
            self.scene, self.scene.system, "spring", self.reduction, self.reference, 50.0,
            GuardSettings(**{"alarm": "estimate", **asked}), self.trained,
        )  # fmt: skip

    def estimates(self, positions: np.ndarray) -> list[float]:
        """The estimate after each frame of a run."""
        running = RunningEstimate(self.trained.motion)
        companion = companion_run(self.scene, self.trained.companion)
        values = []
        for own, other in zip(positions[1:], companion[1:], strict=True):
            running.add(own, other)
            values.append(running.value)
        return values


@pytest.fixture(scope="module")
def case() -> Case:
    handle = {"effect": "translate", "select": "right", "start": 3, "over": 6}
    scene = make_scene(
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        {**handle, "offset": [0.0, 0.1, 0.2]},
        {"effect": "spring", "weight": 1e4},
        mesh={"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"},
        frames=FRAMES,
        iterations=6,
    )
    reference = trajectory(scene, track_objective=False)
    group, spec = scene.groups[0], load_methods(CONFIG / "methods.yaml")["block-deim"]
    snapshots = np.stack([group.project(q) for q in reference[1:]])
    basis = compute_basis(snapshots, np.ones(snapshots.shape[1]), 0.0, 1, spec)
    reduction = Reduction(basis, select(basis, spec, 3), spec, 3)
    frames = np.arange(0, FRAMES, 2)
    asked = CompanionSpec(modes=6, tolerance=1e-3, frames=7)
    companion = companion_model(scene, reference[1:][frames], frames, asked)
    return Case(scene, reference, reduction, Trained.on(reference, companion))


@settings(max_examples=15)
@given(share=st.floats(0.0, 1.2))
def test_an_alarm_is_given_where_the_estimate_exceeds_the_threshold(case, share):
    plain, _ = case.run(action="none")
    values = case.estimates(plain.positions)
    threshold = share * max(values)
    reported, seen = case.run(action="report", threshold=threshold)
    above = [frame for frame, value in enumerate(values) if value > threshold]
    assert seen.count == len(above)
    assert seen.frame == (above[0] if above else None)
    assert seen.reason == ("estimate" if above else None)
    assert seen.estimate == values[-1]
    np.testing.assert_array_equal(reported.positions, plain.positions)


@pytest.mark.parametrize("action", ["stop", "fall-back"])
def test_a_run_whose_estimate_stays_below_the_threshold_keeps_every_bit(case, action):
    plain, _ = case.run(action="none")
    threshold = max(case.estimates(plain.positions))
    same, seen = case.run(action=action, threshold=threshold)
    np.testing.assert_array_equal(same.positions, plain.positions)
    assert (seen.count, seen.fallback_frames, seen.stopped) == (0, 0, False)
    _, other = case.run(action=action, threshold=0.999 * threshold)
    assert other.count > 0


def test_frames_that_fall_back_are_those_with_an_alarm(case):
    """Every frame of the run either keeps to the threshold or was computed in full."""
    plain, _ = case.run(action="none")
    threshold = 0.3 * max(case.estimates(plain.positions))
    helped, seen = case.run(action="fall-back", threshold=threshold)
    values = case.estimates(helped.positions)
    assert 0 < sum(value > threshold for value in values) <= seen.fallback_frames == seen.count
    np.testing.assert_array_equal(
        helped.positions[: seen.frame + 1], plain.positions[: seen.frame + 1]
    )


def test_a_run_that_always_falls_back_is_the_full_order_run(case):
    outcome, seen = case.run(action="fall-back", threshold=0.0)
    assert (seen.count, seen.fallback_frames) == (FRAMES, FRAMES)
    np.testing.assert_array_equal(outcome.positions, case.reference)


def test_stop_ends_the_run_with_the_frame_that_gave_the_alarm(case):
    plain, _ = case.run(action="none")
    threshold = 0.3 * max(case.estimates(plain.positions))
    outcome, seen = case.run(action="stop", threshold=threshold)
    assert seen.stopped
    assert outcome.frames == seen.frame + 1
    assert outcome.blowup_frame is None


def test_a_companion_equal_to_the_run_never_gives_an_alarm(case):
    companion = companion_run(case.scene, case.trained.companion)
    alarm = _alarm(case, threshold=0.0)
    for q in companion[1:]:
        state = State(q, np.zeros_like(q))
        assert alarm.raised(state, REPORT) is None
        alarm.accept(state)
    assert alarm.estimate == 0.0


def test_the_companion_has_holds_of_its_own(case):
    """Pins and handles remember where a run was taken; the run beside must not move them."""
    alone = companion_run(case.scene, case.trained.companion)
    alarm, loop = _alarm(case, threshold=0.0), case.scene.stepper(track_objective=False)
    state, squares = case.scene.initial_state(np.full((30, 3), 0.05)), 0.0
    for frame in range(FRAMES):
        state, report = loop.step(state, frame)
        alarm.raised(state, report)
        alarm.accept(state)
        squares += np.sum((state.positions - alone[frame + 1]) ** 2)
    expected = np.sqrt(squares / FRAMES) / case.trained.motion
    assert alarm.estimate == pytest.approx(expected, rel=1e-12)


def test_where_the_companion_ends_every_frame_gives_an_alarm(case, monkeypatch):
    short = companion_run(case.scene, case.trained.companion)[:4]
    monkeypatch.setattr(
        "pdrom.reduction.local.estimate_alarm.companion_frames", lambda *_: iter(short)
    )
    _, seen = case.run(action="report", threshold=1e6)
    assert (seen.frame, seen.reason, seen.count) == (3, "companion", FRAMES - 3)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_gives_an_alarm(case, value):
    alarm = _alarm(case, threshold=1e6)
    q = np.full_like(case.reference[0], value)
    assert alarm.raised(State(q, q), REPORT) == ("spring", "not finite")


def test_an_estimate_without_a_companion_is_refused(case):
    with pytest.raises(ConfigurationError, match="an auxiliary model is required"):
        guarded_rerun(
            case.scene, case.scene.system, "spring", case.reduction, case.reference, 50.0,
            GuardSettings(alarm="estimate"), Trained.on(case.reference),
        )  # fmt: skip


def _alarm(case: Case, threshold: float) -> EstimateAlarm:
    trained = case.trained
    return EstimateAlarm(case.scene, "spring", trained.companion, trained.motion, threshold)


@given(st.integers(0, 2**32 - 1))
def test_the_largest_estimate_is_that_of_some_frame(seed):
    rng = np.random.default_rng(seed)
    run, companion = rng.standard_normal((2, 7, 4, 3))
    values = [companions.largest_estimate(run, companion, 2.0, end) for end in range(8)]
    assert values[0] is None
    assert all(a <= b for a, b in pairwise(values[1:]))
    assert values[6] == values[7]
    every = np.linalg.norm((run - companion)[1:].reshape(6, -1), axis=1)
    means = [np.sqrt(np.mean(every[:n] ** 2)) / 2.0 for n in range(1, 7)]
    assert values[6] == pytest.approx(max(means))
