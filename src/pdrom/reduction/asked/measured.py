"""Levels tried on motions of one's own: their errors, and what one of their frames misses.

The reference is the implicit step of each motion, here as many accelerated iterations as change
nothing any more. From states of a level's run one frame is done by the full order: the distance of
its end to that of the level's frame is the level's defect there, exactly. A run adds up its defects
and the motion amplifies them: where the defects are no larger than those of motions that were
tried, neither is the error, and where they are larger, it is taken to be larger by as much.
"""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from pdrom.model.dynamics.stepper import State
from pdrom.model.dynamics.whole_frames import BLOCK
from pdrom.model.scene import Scene
from pdrom.reduction.asked.ask import QUANTITIES, Quantity, relative_error
from pdrom.reduction.asked.level import WINDOW, Level, Running
from pdrom.reduction.asked.loops import Loops

# A full order whose frames are compared with those of others; references have as many iterations,
# or twice as many, as long as these reach further.
CONVERGED = Level(80, WINDOW)
MOST = 4 * CONVERGED.iterations
# The frames of a motion count as long as half the iterations, from the same start or from one this
# far apart (of the extent), have at most this error over them: beyond, round-off decides.
MOVED, HORIZON, SEED = 1e-10, 5e-3, 0
# Twice the iterations are worth it where so many times the frames count then.
FURTHER = 1.1
# Frames of a run whose defects are taken.
PROBED = 6
# Frames of a run for its time, at least.
TIMED = 20


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
        start: np.ndarray | None = None
        self.reference, self.iterations = _Accelerated(scene, count).whole(), count
        self.unit = _unit(self.reference)
        self.end = self._horizon(_Accelerated(scene, count // 2, moved))
        while FURTHER * self.end < frames and count < MOST:
            count *= 2
            # a start apart from the reference's, or both would take the same side of a bifurcation
            other = moved if start is None else None
            run = _Accelerated(scene, count, other)
            end = self._horizon(run)
            if end <= FURTHER * self.end:
                self.end = min(self.end, end)
                break
            start, self.reference, self.iterations, self.end = other, run.whole(), count, end
        same = _Accelerated(scene, self.iterations // 2, start)
        self.end = min(self.end, self._horizon(same))

    def _horizon(self, other: "_Accelerated") -> int:
        """Most frames over which another run has at most the error `HORIZON`."""
        moved = np.linalg.norm(self.reference[1:] - self.reference[0], axis=(1, 2))
        allowed = HORIZON**2 * np.cumsum(moved**2)
        end, apart = 0, 0.0
        for frame, positions in enumerate(self.reference[1:]):
            apart += float(np.linalg.norm(positions - other.after(frame))) ** 2
            if not apart <= allowed[-1]:
                break
            if apart <= allowed[frame]:
                end = frame + 1
        return end

    @cached_property
    def touching(self) -> float:
        """Share of all frames at whose end a vertex that is not held touches a contact."""
        frames = self.scene.config.frames
        return sum(self._touches(frame) for frame in range(frames)) / frames

    def _touches(self, frame: int) -> bool:
        free = np.ones(self.scene.mesh.vertices, dtype=bool)
        for boundary in self.scene.boundaries:
            if boundary.active(frame):
                free[boundary.held(frame)] = False
        points = self.reference[frame + 1, free]
        return any((contact.gaps(points) <= 0.0).any() for contact in self.scene.contacts)

    def error(self, positions: np.ndarray, quantity: Quantity) -> float:
        """Error in ``quantity`` of a run with ``positions`` (F + 1, N, 3) m, before the end."""
        last = self.end + 1
        return relative_error(positions[:last], self.reference[:last], quantity)


class _Accelerated:
    """A run of ``scene`` from a start ``moved`` by (N, 3) m, whose frames are done as needed.

    No other run of the scene may begin before its last one: boundaries note where they take hold.
    """

    def __init__(self, scene: Scene, iterations: int, moved: np.ndarray | None = None) -> None:
        self._frames = scene.config.frames
        self._running, self._state = Level(iterations, WINDOW).on(scene), scene.initial_state(moved)
        self._positions = [self._state.positions]

    def after(self, frame: int) -> np.ndarray:
        """Positions (N, 3) m at the end of ``frame``."""
        while (done := len(self._positions) - 1) <= frame:
            some = range(done, min(done + BLOCK, self._frames))
            states = list(self._running.run(self._state, some))
            self._positions += [state.positions for state in states]
            self._state = states[-1]
        return self._positions[frame + 1]

    def whole(self) -> np.ndarray:
        """Positions (F + 1, N, 3) m of all frames, the initial ones first."""
        self.after(self._frames - 1)
        return np.stack(self._positions)


def _unit(reference: np.ndarray) -> float:
    moved = np.linalg.norm(reference[1:] - reference[0], axis=(1, 2))
    return float(np.sqrt(np.mean(moved**2)))


@dataclass(frozen=True)
class Tried:
    """A level on a motion.

    errors : of each quantity
    ms : processor time of a frame
    probe : takes the defects, which cost more than the run and are wanted of few levels
    """

    errors: dict[Quantity, float]
    ms: float
    probe: Callable[[], np.ndarray]

    @cached_property
    def defects(self) -> np.ndarray:
        """Defects (n,) of some frames, in units of the motion."""
        return self.probe()


def tried(level: Level, motion: Motion, loops: Loops | None = None) -> Tried:
    """Run ``level`` on a motion, up to its end; defects are taken with `exact_beside` it.

    ``loops`` on the motion take the place of fresh ones.
    """
    loops = loops or Loops(motion.scene)
    running = loops.on(level)
    state = running.inside(motion.scene.initial_state())
    frames = min(max(motion.end, TIMED), motion.scene.config.frames)
    started = loops.clock()
    states = [state, *running.run(state, range(frames))]
    ms = 1e3 * (loops.clock() - started) / frames
    positions = np.stack([running.positions(each.positions) for each in states])
    errors = {q: motion.error(positions, q) for q in QUANTITIES}
    last = max(motion.end - 1, 0)
    probed = np.unique(np.linspace(0, last, PROBED + 1).round().astype(int)[1:])
    ends = {
        int(f): (_alone(running.outside(states[f])), _alone(running.outside(states[f + 1])))
        for f in probed
        if np.isfinite(positions[f + 1]).all()
    }
    # later runs take hold elsewhere
    scene = replace(motion.scene, boundaries=deepcopy(motion.scene.boundaries))
    return Tried(errors, ms, partial(_defects, level, motion, scene, ends))


def _alone(state: State) -> State:
    """A copy: the states of a loop are parts of blocks of many frames, which would stay, too."""
    return State(state.positions.copy(), state.velocities.copy())


def _defects(
    level: Level, motion: Motion, scene: Scene, ends: dict[int, tuple[State, State]]
) -> np.ndarray:
    exact = Running(exact_beside(level), scene, motion.scene.system)
    found = [defect(*around, exact, frame) for frame, around in ends.items()]
    return np.array(found) / motion.unit


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
