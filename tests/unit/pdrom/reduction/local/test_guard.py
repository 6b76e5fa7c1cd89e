"""The guard: what it notices, what it leaves alone, and what falling back gives."""

import logging

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from builders import GROUPS, make_scene
from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.local.guard import Guard, GuardRecord
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.local.guarded import Trained, guarded_rerun
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import replace_group, rerun
from pdrom.reduction.local.trained_range import TrainedRange
from pdrom.reduction.local.watched import WatchedLocalStep
from pdrom.reduction.method import load_methods
from pdrom.reduction.sampling import Reduction, select
from places import CONFIG

PRESETS = load_methods(CONFIG / "methods.yaml")
FRAMES, ITERATIONS = 12, 6


class Case:
    """A pinned scene with one group, snapshots of every iterate, and reductions of it."""

    def __init__(self, group: str) -> None:
        effects = [{"effect": "gravity"}, {"effect": "pins", "select": "left"}]
        effects.append({"effect": group, "weight": 1e4})
        mesh = {**GROUPS[group], "plane": "xz"} if "rows" in GROUPS[group] else GROUPS[group]
        self.scene = make_scene(*effects, mesh=mesh, frames=FRAMES, iterations=ITERATIONS)
        self.group = self.scene.groups[0]
        seen = []

        class Recorded:
            name = group
            begin_frame = staticmethod(self.group.begin_frame)

            @staticmethod
            def accumulate(y, rhs, own=self.group):
                seen.append(own.project(y))
                return own.accumulate(y, rhs)

        self.reference = trajectory(self.scene, local_steps=[Recorded()])
        self.snapshots = np.stack(seen)

    def reduction(self, method: str, r: int | None = None, every: int = 1) -> Reduction:
        chosen = self.snapshots[::every]
        masses = np.ones(chosen.shape[1])
        spec = PRESETS[method]
        basis = compute_basis(chosen, masses, 0.0, self.group.rows_per_element, spec)
        # elements that keep their size hardly leave it here: few modes
        r = basis.rank if r is None else min(r, basis.rank)
        return Reduction(basis, select(basis, spec, r), spec, r)

    def run(self, reduction: Reduction, **settings):
        return guarded_rerun(
            self.scene, self.scene.system, self.group.name, reduction, self.reference, 50.0,
            GuardSettings(**settings), Trained.on(self.reference),
        )  # fmt: skip


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    return {group: Case(group) for group in GROUPS}


@pytest.fixture(params=sorted(GROUPS))
def case(request, cases) -> Case:
    """Every group in turn."""
    return cases[request.param]


@pytest.fixture
def spring(cases) -> Case:
    return cases["spring"]


@pytest.mark.parametrize("action", ["report", "stop", "fall-back"])
def test_a_benign_run_at_full_rank_is_left_alone(case, action):
    """Every projection is in the span: nothing leaves the box, the objective cannot rise."""
    reduction = case.reduction("pod")
    outcome, seen = case.run(reduction, action=action, margin=1e-6, extent=1.0 + 1e-6, rise=1e-6)
    assert seen == GuardRecord()
    plain, unseen = case.run(reduction, action="none")
    assert unseen == GuardRecord.unwatched()
    assert unseen.columns()["guard_count"] is None
    np.testing.assert_array_equal(outcome.positions, plain.positions)


@pytest.mark.parametrize("method", ["deim", "deim-joint", "published", "block-deim", "gappy"])
def test_watching_changes_no_bit(case, method):
    reduction = case.reduction(method, r=4)
    watched, _ = case.run(reduction, action="report")
    plain, _ = case.run(reduction, action="none")
    np.testing.assert_array_equal(watched.positions, plain.positions)


def test_a_run_that_always_falls_back_is_the_full_order_run(case):
    """Coefficients may not move at all: every frame leaves the box."""
    reduction = case.reduction("block-deim", r=3, every=5)
    reduction.basis.trained[...] = 1e9
    outcome, seen = case.run(reduction, action="fall-back")
    assert (seen.count, seen.fallback_frames) == (FRAMES, FRAMES)
    np.testing.assert_array_equal(outcome.positions, case.reference)


def test_the_energy_of_a_watched_step_is_that_of_its_projections(case):
    """1/2 |W^1/2 (S y - p^)|^2 with p^ written out, at the iterates that it looks at."""
    rng = np.random.default_rng(4)
    y = case.reference[-1] + 0.01 * rng.standard_normal(case.reference[-1].shape)
    for method in ("pod", "deim", "deim-joint", "published", "block-deim"):
        reduction = case.reduction(method, r=4)
        step = WatchedLocalStep(case.group, reduction, ITERATIONS)
        step.begin_frame(case.reference[-1])
        assert list(step.watched) == [ITERATIONS // 2, ITERATIONS - 1]
        assert np.isnan(step.accumulate(y, np.zeros_like(y)))
        energy = step.look(y, np.zeros_like(y))
        p = reduction.reconstruct(case.group.project(y)[None])[0]
        difference = case.group.S @ y - p
        expected = 0.5 * float(case.group.row_weights @ (difference**2).sum(axis=1))
        scale = 0.5 * float(case.group.row_weights @ (p**2).sum(axis=1))
        np.testing.assert_allclose(energy, expected, rtol=1e-6, atol=1e-12 * scale)


def test_coefficients_outside_the_box_are_measured_from_it(spring):
    """One side of the box moved away by its diagonal: the distance is one."""
    reduction = spring.reduction("pod")
    basis = reduction.basis
    diagonal = np.linalg.norm(basis.trained[0, 1] - basis.trained[0, 0])
    step = WatchedLocalStep(spring.group, reduction, ITERATIONS)
    step.begin_frame(spring.reference[0])
    step.look(spring.reference[3], np.zeros_like(spring.reference[3]))
    # not an iterate of the run, but next to one
    assert step.distance() <= 1e-6
    c = basis.V.T @ (spring.group.project(spring.reference[3]).ravel() - basis.mean)
    far = c + diagonal * np.eye(len(c))[0]
    basis.trained[0, :, 0] += far[0] - basis.trained[0, 0, 0]
    step = WatchedLocalStep(spring.group, reduction, ITERATIONS)
    step.begin_frame(spring.reference[0])
    step.look(spring.reference[3], np.zeros_like(spring.reference[3]))
    assert step.distance() == pytest.approx(1.0, rel=1e-9)


class Told:
    """A loop that returns what it is told, frame by frame."""

    def __init__(self, positions, objective) -> None:
        self.positions, self.objective = positions, objective

    def step(self, state, frame):
        report = FrameReport(np.array(self.objective[frame]), np.zeros(4))
        return State(self.positions[frame], self.positions[frame]), report


class Quiet:
    """A step whose coefficients lie as far out as it is told."""

    name = "spring"
    projection_energy = 1.0

    def __init__(self, distance=0.0) -> None:
        self._distance = distance

    def distance(self):
        return self._distance


BOX = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.2]])
FALLING = [np.nan, 2.0, np.nan, 1.0]


def watch(distance=0.0, position=BOX, objective=FALLING, **settings) -> GuardRecord:
    """Record of a guard after frame 3 of a loop."""
    told = Told({3: position}, {3: objective})
    return watched([Quiet(), Quiet(distance)], told, 3, **settings)


def watched(steps, told, frame, **settings) -> GuardRecord:
    """Record of a guard after a frame of a loop with these steps."""
    alarm = TrainedRange(GuardSettings(**settings), steps, 1.0)
    guard = Guard("report", alarm, told, told)
    guard.step(State(BOX, BOX), frame)
    return guard.record


def test_a_calm_frame_is_no_news():
    assert watch() == GuardRecord()


@pytest.mark.parametrize(
    ("reason", "changes"),
    [
        ("coefficients", {"distance": 0.11}),
        ("not finite", {"distance": np.nan}),
        ("not finite", {"distance": np.inf}),
        ("not finite", {"position": np.array([[0.0, np.nan, 0.0], [1.0, 0.0, 0.0]])}),
        ("not finite", {"position": np.full((2, 3), np.inf)}),
        ("extent", {"position": 1.6 * BOX}),
        ("extent", {"position": np.array([[0.0, -1.0, 0.0], [1.0, 0.6, 0.2]])}),
        ("objective", {"objective": [np.nan, 1.0, np.nan, 1.2]}),
        ("objective", {"objective": [5.0, 3.0, 1.0, 1.2]}),
    ],
)
def test_each_reason_is_noticed_in_its_frame(reason, changes, caplog):
    with np.errstate(invalid="ignore"), caplog.at_level(logging.WARNING):
        record = watch(**changes)
    assert (record.frame, record.reason, record.count) == (3, reason, 1)
    assert f"frame 3, group {record.group}" in caplog.text


@pytest.mark.parametrize(
    "changes",
    [
        {"distance": 0.1},
        {"position": 1.5 * BOX},
        {"position": BOX + 1e6},
        {"objective": [np.nan, 1.0, np.nan, 1.09]},
        {"objective": [np.nan, 1e-14, np.nan, 1e-13]},
        {"objective": [np.nan] * 4},
        {"objective": []},
    ],
)
def test_what_stays_within_the_limits_is_no_news(changes):
    """The last but two: the rise is below the cancellation; and nobody knows the objective."""
    assert watch(**changes).count == 0


@pytest.mark.parametrize(("steps", "group"), [(1, "spring"), (2, "all")])
def test_a_group_is_named_where_only_it_is_reduced(steps, group):
    record = watched([Quiet() for _ in range(steps)], Told({0: 9.0 * BOX}, {0: FALLING}), 0)
    assert (record.group, record.reason) == (group, "extent")


@given(st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_the_margin_decides(distance, margin):
    assert watch(distance=distance, margin=margin).count == int(distance > margin)


def test_stop_ends_the_run_with_the_frame_that_left(spring):
    reduction = spring.reduction("deim-joint", r=5, every=4)
    reported, seen = spring.run(reduction, action="report", margin=1e-3)
    stopped, record = spring.run(reduction, action="stop", margin=1e-3)
    assert seen.frame is not None
    assert record.stopped
    assert (record.frame, record.reason, record.count) == (seen.frame, seen.reason, 1)
    assert stopped.frames == seen.frame + 1
    assert stopped.blowup_frame is None
    np.testing.assert_array_equal(stopped.positions, reported.positions[: seen.frame + 2])


def test_frames_that_fall_back_start_from_the_reduced_state(spring):
    """The run is a mixture: up to the first departure the reduced one, then one full frame."""
    reduction = spring.reduction("block-deim", r=4, every=4)
    plain, seen = spring.run(reduction, action="report", margin=1e-3)
    mixed, record = spring.run(reduction, action="fall-back", margin=1e-3)
    first = seen.frame
    assert 0 < record.fallback_frames <= FRAMES
    np.testing.assert_array_equal(mixed.positions[: first + 1], plain.positions[: first + 1])
    h = spring.scene.config.time_step
    before = mixed.positions[first - 1] if first else mixed.positions[0]
    state = State(mixed.positions[first], (mixed.positions[first] - before) / h)
    expected, _ = spring.scene.stepper().step(state, first)
    np.testing.assert_allclose(mixed.positions[first + 1], expected.positions, rtol=0, atol=1e-12)


def test_falling_back_helps_where_single_axes_are_singular(spring):
    """A failing method: the error with fall-back is far below the one without."""
    reduction = spring.reduction("deim-joint", r=5, every=4)
    plain, _ = spring.run(reduction, action="none")
    helped, record = spring.run(reduction, action="fall-back")
    assert record.fallback_frames > 0
    assert np.linalg.norm(helped.difference) < 0.1 * np.linalg.norm(plain.difference)


def test_a_plain_step_knows_no_energy(spring):
    """Nothing is added to unguarded runs: their objective stays unknown."""
    step = ReducedLocalStep(spring.group, spring.reduction("pod", r=3))
    loop = spring.scene.stepper(local_steps=replace_group(spring.scene, "spring", step))
    _, report = loop.step(spring.scene.initial_state(), 0)
    assert np.isnan(report.objective).all()


def test_without_a_guard_a_rerun_is_as_before(spring):
    reduction = spring.reduction("pod", r=3)
    step = ReducedLocalStep(spring.group, reduction)
    plain = rerun(spring.scene, spring.scene.system, [step], spring.reference, 50.0)
    again, _ = spring.run(reduction, action="none")
    np.testing.assert_array_equal(plain.positions, again.positions)


def test_who_watched_and_saw_nothing_is_told_from_nobody():
    counts = ("guard_count", "fallback_frames")
    assert [GuardRecord().columns()[name] for name in counts] == [0, 0]
    assert [GuardRecord.unwatched().columns()[name] for name in counts] == [None, None]


@pytest.mark.parametrize("key", ["threshold", "margin", "extent", "rise"])
@pytest.mark.parametrize("value", [-1.0, np.inf, np.nan])
def test_limits_are_finite_and_not_negative(key, value):
    with pytest.raises(ValidationError, match=key):
        GuardSettings(**{key: value})
