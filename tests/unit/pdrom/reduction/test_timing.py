"""Timings: interleaved, after a warm-up, phases of one repeat."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pdrom.model.dynamics.stepper import FrameReport, State
from pdrom.reduction.timing import PHASES, Variant, measure, measure_calls


class Clock:
    """A step loop that reports given times and records its calls."""

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


START = State(np.zeros((2, 3)), np.zeros((2, 3)))


def seconds(*totals: float):
    """Phases (inertia, local, global, finish) of frames that take ``totals`` in all."""
    return [np.array([0.1, 0.5, 0.3, 0.1]) * t for t in totals]


def variant(name, calls, totals, frames=1, **settings) -> Variant:
    loop = Clock(name, calls, seconds(*totals), **settings)
    return Variant({"name": name}, loop, START, frames)


def test_timed_variants_take_turns_and_start_from_the_same_state():
    calls = []
    measure([variant("a", calls, [1.0] * 9, 2), variant("b", calls, [1.0] * 9, 1)], 1, 2)
    assert calls == [("a", 0, 0.0), ("a", 1, 1.0), ("b", 0, 0.0)] * 3
    assert (START.positions == 0.0).all()


@pytest.mark.parametrize(
    ("times", "frames", "warmup", "repeats", "mean"),
    [
        # the warm-up does not count
        ([1e6, 2.0, 2.0, 2.0], 1, 1, 3, 2.0),
        ([1.0, 3.0], 2, 0, 1, 2.0),
        ([5.0, 1.0, 2.0], 1, 0, 3, 2.0),
        # every repeat is interrupted once, in another frame
        ([9.0, 2.0, 3.0, 1.0, 9.0, 3.0, 1.0, 2.0, 9.0], 3, 0, 3, 2.0),
    ],
)
def test_the_median_repeat_of_a_frame_counts_with_its_phases(times, frames, warmup, repeats, mean):
    (result,) = measure([variant("a", [], times, frames)], warmup=warmup, repeats=repeats)
    assert result["name"] == "a"
    assert result["ms_per_frame"] == pytest.approx(1e3 * mean)
    assert result["local_ms"] == pytest.approx(0.5e3 * mean)
    assert result["global_ms"] == pytest.approx(0.3e3 * mean)
    assert result["assembly_ms"] == 0.0


def test_assembly_is_subtracted_from_the_local_step_and_phases_add_up():
    assembling = SimpleNamespace(assembly_seconds=77.0)
    steps = [assembling, SimpleNamespace(assembly_seconds=77.0, lift_seconds=55.0)]
    (result,) = measure([variant("a", [], [0.1] * 4, 2, local_steps=steps)], warmup=1, repeats=1)
    assert result["assembly_ms"] == pytest.approx(2.0)
    assert result["local_ms"] == pytest.approx(50.0 - 2.0)
    assert result["inertia_ms"] == pytest.approx(20.0)
    assert result["lift_ms"] == 0.0  # reset before the run, and this step never lifts
    assert sum(result[name] for name in PHASES[1:]) == pytest.approx(result["ms_per_frame"])
    assert result["ms_per_frame"] == pytest.approx(100.0)


def test_times_of_some_iterations_are_extrapolated_to_all():
    """Inertia takes time once a frame, the other phases in every iteration."""
    clock = Clock("a", [], seconds(1.0))
    (result,) = measure([Variant({}, clock, START, 1, share=0.25)], 0, 1)
    assert [result[name] for name in ("inertia_ms", "local_ms", "global_ms", "ms_per_frame")] == [
        pytest.approx(ms) for ms in (200.0, 2000.0, 1200.0, 3400.0)
    ]


def test_the_time_of_a_frame_includes_the_positions_of_all_vertices():
    """They are computed after the iterations; frames may begin at states along a run."""
    made, calls, times = [], [], seconds(1.0, 1.0, 1.0, 1.0)
    show, starts = (lambda y: made.append(y[0, 0])), ((START, 5), (START, 9))
    whole = Variant({}, Clock("a", [], times), START, 4, output=show, steps=2)
    spread = Variant({}, Clock("b", calls, times), START, 4, steps=2, starts=starts)
    own, other = measure([whole, spread], 0, 1)
    assert made == [2.0, 4.0]
    assert calls == [("b", 5, 0.0), ("b", 6, 1.0), ("b", 9, 0.0), ("b", 10, 1.0)]
    assert own["ms_per_frame"] == pytest.approx(1000.0 + own["vertices_ms"], rel=1e-12)
    assert other["vertices_ms"] == 0.0
    calls.clear()
    measure([replace(spread, loop=Clock("b", calls, seconds(*6 * [1.0])), warm=2)], 1, 1)
    assert [frame for _, frame, _ in calls] == [5, 6, 5, 6, 9, 10]


def test_timed_calls_take_turns():
    calls = []
    times = measure_calls({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 1, 3)
    assert calls == list(times) * 4 == ["a", "b"] * 4


def test_a_diverged_run_is_timed_up_to_its_last_frame():
    calls = []
    (result,) = measure([variant("a", calls, [1.0, 3.0, 100.0], 3, bad_frame=1)], 0, 1)
    assert [frame for _, frame, _ in calls] == [0, 1]
    assert result["ms_per_frame"] == pytest.approx(2000.0)
