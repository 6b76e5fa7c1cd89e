"""Levels tried on motions of one's own: their errors, and what one of their frames misses.

The reference is the implicit step of each motion, here as many accelerated iterations as change
nothing any more. From states of a level's run one frame is done by the full order: the distance of
its end to that of the level's frame is the level's defect there, exactly. A run adds up its defects
and the motion amplifies them: where the defects are no larger than those of motions that were
tried, neither is the error, and where they are larger, it is taken to be larger by as much.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import thread_time

import numpy as np

from pdrom.model.dynamics.stepper import State
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.asked.ask import QUANTITIES, Quantity, relative_error
from pdrom.reduction.asked.level import WINDOW, Level, Running

# A full order whose frames are compared with those of others; references have as many iterations,
# or twice as many, as long as these reach further.
CONVERGED = Level(80, WINDOW)
MOST = 4 * CONVERGED.iterations
# The frames of a motion count until starts this far apart (of the extent) and half the iterations
# lead to positions that differ by more than this part of the motion: then round-off decides.
MOVED, HORIZON, SEED = 1e-10, 5e-3, 0
# Frames of a run whose defects are taken.
PROBED = 6


class Motion:
    """A motion that levels are tried on, with its reference.

    iterations : of the reference
    end : frames before it count
    unit : root mean square displacement of a frame, m
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        hair = np.random.default_rng(SEED).standard_normal(scene.mesh.points.shape)
        moved = MOVED * scene.mesh.extent * hair
        count, frames = CONVERGED.iterations, scene.config.frames
        less = _accelerated(scene, count // 2, moved)
        self.reference, self.iterations = _accelerated(scene, count), count
        self.unit = _unit(self.reference)
        self.end = _horizon(less, self.reference, self.unit)
        while self.end < frames and count < MOST:
            count *= 2
            further = _accelerated(scene, count, moved)
            end = _horizon(self.reference, further, self.unit)
            if end <= 1.1 * self.end:
                break
            self.reference, self.iterations, self.end = further, count, end

    def error(self, positions: np.ndarray, quantity: Quantity) -> float:
        """Error in ``quantity`` of a run with ``positions`` (F + 1, N, 3) m, before the end."""
        last = self.end + 1
        return relative_error(positions[:last], self.reference[:last], quantity)


def _accelerated(scene: Scene, iterations: int, moved: np.ndarray | None = None) -> np.ndarray:
    return trajectory(Level(iterations, WINDOW).scene(scene), moved, track_objective=False)


def _unit(reference: np.ndarray) -> float:
    moved = np.linalg.norm(reference[1:] - reference[0], axis=(1, 2))
    return float(np.sqrt(np.mean(moved**2)))


def _horizon(one: np.ndarray, other: np.ndarray, unit: float) -> int:
    """Frames (of F) before the first at which two runs are too far apart."""
    apart = np.linalg.norm((one - other)[1:], axis=(1, 2))
    late = np.flatnonzero(~(apart <= HORIZON * unit))
    return int(late[0]) if len(late) else len(apart)


@dataclass(frozen=True)
class Tried:
    """A level on a motion.

    errors : of each quantity
    defects : (n,) of some frames, in units of the motion
    ms : processor time of a frame
    """

    errors: dict[Quantity, float]
    defects: np.ndarray
    ms: float


def tried(level: Level, motion: Motion) -> Tried:
    """Run ``level`` on a motion; its defects are taken with `exact_beside` it."""
    running = level.on(motion.scene)
    state = running.inside(motion.scene.initial_state())
    frames, started = motion.scene.config.frames, thread_time()
    states = [state, *running.run(state, range(frames))]
    ms = 1e3 * (thread_time() - started) / frames
    positions = np.stack([running.positions(each.positions) for each in states])
    errors = {q: motion.error(positions, q) for q in QUANTITIES}
    last = max(motion.end - 1, 0)
    probed = np.unique(np.linspace(0, last, PROBED + 1).round().astype(int)[1:])
    exact = exact_beside(level).on(motion.scene)
    found = [
        defect(running.outside(states[f]), running.outside(states[f + 1]), exact, frame=int(f))
        for f in probed
        if np.isfinite(positions[f + 1]).all()
    ]
    return Tried(errors, np.array(found) / motion.unit, ms)


def exact_beside(level: Level) -> Level:
    """A full order that sees what a frame of ``level`` misses: its own iterations twice at least.

    A check by fewer would call the better frame wrong, and none at all where both stop too soon.
    """
    if level.model is not None or level.iterations <= CONVERGED.iterations // 2:
        return CONVERGED
    return Level(2 * level.iterations, WINDOW)


def defect(before: State, after: State, exact: Running, frame: int) -> float:
    """Distance, m, of the end ``after`` of ``frame`` to what ``exact`` reaches from ``before``."""
    (end,) = exact.run(before, range(frame, frame + 1))
    return float(np.linalg.norm(after.positions - end.positions))


def worst(found: Sequence[Tried], quantity: Quantity) -> float:
    """Largest error in ``quantity`` of a level on the motions that it was tried on, ``found``."""
    return max(each.errors[quantity] for each in found)
