"""Loops that remember their frames."""

from itertools import count

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.dynamics.stepper import State
from pdrom.reduction.asked import loops
from pdrom.reduction.asked.level import Level, Running
from pdrom.reduction.asked.loops import Remembered

FRAMES, HALF = range(20), range(9)


@pytest.fixture
def remembered(monkeypatch) -> Remembered:
    """Loops with a clock that every look at it moves on by a second."""
    ticks = count()
    monkeypatch.setattr(loops, "thread_time", lambda: float(next(ticks)))
    spring = {"effect": "spring", "weight": 1e5}
    pins = {"effect": "pins", "select": "left"}
    late = {"effect": "pins", "select": "right", "start": 5}
    return Remembered(make_scene({"effect": "gravity"}, pins, late, spring, frames=len(FRAMES)))


def timed(remembered: Remembered, state: State, frames: range) -> tuple[list[State], float]:
    began = remembered.clock()
    states = list(remembered.on(Level(3)).run(state, frames))
    return states, remembered.clock() - began


def same(states: list[State], others: list[State]) -> bool:
    return all(
        np.array_equal(one.positions, other.positions)
        and np.array_equal(one.velocities, other.velocities)
        for one, other in zip(states, others, strict=True)
    )


def test_frames_are_done_once_and_take_the_same_time_again(remembered, monkeypatch):
    start = remembered.scene.initial_state()
    alone = list(Level(3).on(remembered.scene).run(start, FRAMES))
    first, seconds = timed(remembered, start, FRAMES)
    monkeypatch.delattr(Running, "run")
    again, then = timed(remembered, start, FRAMES)
    assert same(first, alone)
    assert same(again, alone)
    assert then == pytest.approx(seconds)


def test_what_is_missing_is_done(remembered):
    start = remembered.scene.initial_state()
    alone = list(Level(3).on(remembered.scene).run(start, FRAMES))
    timed(remembered, start, HALF)
    # a run between takes hold elsewhere
    assert not same(list(Level(1).on(remembered.scene).run(start, FRAMES)), alone)
    whole, _ = timed(remembered, start, FRAMES)
    assert same(whole, alone)
    # an equal state of other arrays is the same state
    copied = State(alone[8].positions.copy(), alone[8].velocities.copy())
    assert same(timed(remembered, copied, FRAMES[9:])[0], alone[9:])
    # another one is not
    faster = State(copied.positions, 2.0 * copied.velocities)
    expected = list(Level(3).on(remembered.scene).run(faster, FRAMES[9:]))
    assert same(timed(remembered, faster, FRAMES[9:])[0], expected)


def test_levels_share_no_frames(remembered):
    start = remembered.scene.initial_state()
    few = list(remembered.on(Level(3)).run(start, HALF))
    more = list(remembered.on(Level(4)).run(start, HALF))
    assert same(more, list(Level(4).on(remembered.scene).run(start, HALF)))
    assert not same(few, more)
