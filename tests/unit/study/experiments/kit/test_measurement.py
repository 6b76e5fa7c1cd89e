"""Timings: interleaved, after a warm-up, started afresh, and the phases of one repeat."""

import numpy as np
import pytest

from pdrom.model.dynamics.stepper import FrameReport, State
from study.experiments.kit.measurement import Variant, measure, measure_calls


class Clock:
    """A step loop that takes the seconds it is told, and records its calls."""

    def __init__(self, name: str, calls: list, seconds, local_steps=(), bad_frame=None) -> None:
        self.name, self.calls, self.seconds = name, calls, iter(seconds)
        self.local_steps, self.bad_frame = list(local_steps), bad_frame

    def step(self, state: State, frame: int) -> tuple[State, FrameReport]:
        self.calls.append((self.name, frame, float(state.positions[0, 0])))
        bad = frame == self.bad_frame
        positions = state.positions + (np.nan if bad else 1.0)
        for step in self.local_steps:
            step.assembly_seconds += 0.001
        return State(positions, state.velocities), FrameReport(np.empty(0), next(self.seconds))


class Assembling:
    """A local step that measures its assembly."""

    assembly_seconds = 77.0


START = State(np.zeros((2, 3)), np.zeros((2, 3)))


def seconds(*totals: float):
    """Phases (inertia, local, global, finish) of frames that take ``totals`` in all."""
    return [np.array([0.1, 0.5, 0.3, 0.1]) * t for t in totals]


def variant(name, calls, totals, frames=1, **settings) -> Variant:
    loop = Clock(name, calls, seconds(*totals), **settings)
    return Variant({"name": name}, loop, START, frames)


def test_variants_take_turns_and_start_afresh():
    calls = []
    pair = [variant("a", calls, [1.0] * 9, 2), variant("b", calls, [1.0] * 9, 1)]
    measure(pair, warmup=1, repeats=2)
    assert calls == [("a", 0, 0.0), ("a", 1, 1.0), ("b", 0, 0.0)] * 3
    assert (START.positions == 0.0).all()


@pytest.mark.parametrize(
    ("times", "frames", "warmup", "repeats"),
    [([1e6, 2.0, 2.0, 2.0], 1, 1, 3), ([1.0, 3.0], 2, 0, 1)],
)
def test_time_is_per_frame_and_warm_up_does_not_count(times, frames, warmup, repeats):
    (result,) = measure([variant("a", [], times, frames)], warmup=warmup, repeats=repeats)
    assert result.frame == pytest.approx(2000.0)
    assert result.repeats == repeats
    if warmup:
        assert (result.low, result.high) == pytest.approx((2000.0, 2000.0))


def test_median_repeat_with_its_own_phases():
    (result,) = measure([variant("a", [], [5.0, 1.0, 2.0])], warmup=0, repeats=3)
    assert result.labels == {"name": "a"}
    assert result.frame == pytest.approx(2000.0)
    assert result.local == pytest.approx(1000.0)
    assert result.solve == pytest.approx(600.0)
    assert result.assembly == 0.0
    assert (result.low, result.high) == pytest.approx((1000.0, 5000.0))


def test_an_interruption_of_one_frame_is_left_out():
    """Every repeat is interrupted once, in another frame."""
    runs = [9.0, 2.0, 3.0, 1.0, 9.0, 3.0, 1.0, 2.0, 9.0]
    (result,) = measure([variant("a", [], runs, 3)], warmup=0, repeats=3)
    assert result.frame == pytest.approx(1e3 * (1.0 + 2.0 + 3.0) / 3)
    assert result.local == pytest.approx(0.5 * result.frame)


def test_assembly_is_taken_out_of_the_local_step():
    steps = [Assembling(), Assembling()]
    (result,) = measure([variant("a", [], [0.1] * 4, 2, local_steps=steps)], warmup=1, repeats=1)
    assert result.assembly == pytest.approx(2.0)
    assert result.local == pytest.approx(50.0 - 2.0)
    assert result.frame == pytest.approx(100.0)


class Lifting(Assembling):
    """A local step that measures its lift, too."""

    lift_seconds = 55.0


def test_phases_add_up_to_the_frame():
    (result,) = measure([variant("a", [], [0.1, 0.1], local_steps=[Lifting()])], 1, 1)
    assert result.inertia == pytest.approx(20.0)
    assert result.lift == 0.0  # set back before the run, and this step never lifts
    phases = result.inertia + result.local + result.assembly + result.lift + result.solve
    assert phases == pytest.approx(result.frame) == pytest.approx(100.0)


def test_a_part_of_the_iterations_stands_for_all():
    """Inertia is paid once a frame, the other phases with every iteration."""
    clock = Clock("a", [], seconds(1.0))
    (result,) = measure([Variant({}, clock, START, 1, share=0.25)], 0, 1)
    assert result.inertia == pytest.approx(200.0)
    assert result.local == pytest.approx(2000.0)
    assert result.solve == pytest.approx(1200.0)
    assert result.frame == pytest.approx(3400.0)


def test_calls_take_turns():
    calls = []
    times = measure_calls({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 1, 3)
    assert calls == ["a", "b"] * 4
    assert set(times) == {"a", "b"}
    assert all(value >= 0.0 for value in times.values())


def test_a_run_that_blows_up_is_timed_up_to_there():
    calls = []
    (result,) = measure(
        [variant("a", calls, [1.0, 3.0, 100.0], 3, bad_frame=1)], warmup=0, repeats=1
    )
    assert [frame for _, frame, _ in calls] == [0, 1]
    assert result.frame == pytest.approx(2000.0)


def test_progress_is_told():
    told = []
    measure([variant("a", [], [1.0] * 4)], 1, 3, lambda *args: told.append(args))
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
