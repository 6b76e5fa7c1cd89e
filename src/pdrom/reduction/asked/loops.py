"""Step loops of levels on a motion, and a clock for them."""

from collections.abc import Iterator
from hashlib import blake2b
from time import thread_time

from pdrom.model.dynamics.stepper import State
from pdrom.model.scene import Scene
from pdrom.reduction.asked.level import Level, Running


class Loops:
    """Step loops on the motion of ``scene``."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def on(self, level: Level) -> Running:
        """A loop of ``level``."""
        return level.on(self.scene)

    def clock(self) -> float:
        """Processor time, s, from an arbitrary start."""
        return thread_time()


class Remembered(Loops):
    """Loops that do no full-order frame twice: many runs of a motion have most of them in common.

    A full-order frame depends on nothing but its number, the state before it, and where vertices
    were when they were taken hold of, which is noted again. One that was done before takes, by the
    clock, the time that it took then. Reductions are no part of this: where they meet a floor,
    round-off depends on the frames before.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._loops: dict[str, Running] = {}
        self._credit = 0.0

    def on(self, level: Level) -> Running:
        if level.model is not None:
            return super().on(level)
        if level.title not in self._loops:
            self._loops[level.title] = _Remembering(level, self)
        return self._loops[level.title]

    def clock(self) -> float:
        return thread_time() + self._credit

    def took(self, seconds: float, since: float) -> None:
        """Let what was done since the clock showed ``since`` have taken ``seconds``."""
        self._credit += seconds - (self.clock() - since)


class _Remembering(Running):
    """A full-order loop with the frames that it has done, and the time of each."""

    def __init__(self, level: Level, loops: Remembered) -> None:
        super().__init__(level, loops.scene)
        self._loops = loops
        self._known: dict[tuple[int, bytes], tuple[State, float]] = {}

    def run(self, state: State, frames: range) -> Iterator[State]:
        since, total, ends = self._loops.clock(), 0.0, []
        for frame in frames:
            key = frame, _digest(state)
            if key in self._known:
                self._take_hold(state, frame)
            else:
                self._do(state, range(frame, frames.stop))
            state, seconds = self._known[key]
            ends.append(state)
            total += seconds
        self._loops.took(total, since)
        return iter(ends)

    def _do(self, state: State, frames: range) -> None:
        """Do ``frames`` from ``state``, and keep them."""
        started = thread_time()
        ends = list(super().run(state, frames))
        seconds = (thread_time() - started) / len(frames)
        for frame, after in zip(frames, ends, strict=True):
            self._known[frame, _digest(state)] = after, seconds
            state = after

    def _take_hold(self, state: State, frame: int) -> None:
        """Let the boundaries note what they note in ``frame`` when it is done from ``state``."""
        for boundary in self._loops.scene.boundaries:
            if boundary.active(frame) and boundary.takes_hold(frame):
                boundary.targets(frame, state.positions[boundary.held(frame)])


def _digest(state: State) -> bytes:
    found = blake2b(state.positions.tobytes(), digest_size=16)
    found.update(state.velocities.tobytes())
    return found.digest()
