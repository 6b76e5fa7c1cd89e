"""Settings that simulate one scene, to be compared by error and time: iterations of the full-order
model, on the scene's mesh or a coarser mesh, or a reduced model.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from pdrom.model.coarser import Coarser
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.runs import BLOWUP_EXTENT, BoundedRun
from pdrom.model.scene import Scene
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.timing import Variant

PLAIN, ANDERSON = "projective", "anderson"
COARSER, COARSER_ANDERSON = "coarser-mesh", "coarser-mesh-anderson"
Starts = tuple[tuple[State, int], ...]


def _same(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class Setting:
    """A method with its settings, ready to run on one scene.

    positions : function of the unknowns that returns the positions (N, 3) m of the scene's vertices
    output : faster form of ``positions``, which is timed; None: the unknowns are the positions
    """

    labels: dict[str, Any]  # columns that identify the setting
    loop: Stepper
    start: State  # first state, in its unknowns
    positions: Callable[[np.ndarray], np.ndarray] = _same
    output: Callable[[np.ndarray], np.ndarray] | None = None
    state: Callable[[State], State] = _same  # maps a state of all vertices to one of the unknowns
    steps: int = 1  # frames of ``loop`` into which a frame of the scene is divided

    def run(self, frames: int, extent: float) -> np.ndarray | None:
        """Run the setting; return positions (F + 1, N, 3) m at the start and after F frames.

        None if the run blew up: a side of its bounding box exceeds `BLOWUP_EXTENT` ``extent`` (m).
        """
        steps, limit = frames * self.steps, BLOWUP_EXTENT
        run = BoundedRun(self.loop.run, self.start, steps, limit, extent, self.positions)
        found = [self.positions(self.start.positions)]
        with np.errstate(over="ignore", invalid="ignore"):
            found += [f.positions for f in run if (f.number + 1) % self.steps == 0]
        return None if run.blowup_frame is not None else np.stack(found)

    def errors(self, truth: Yardstick) -> tuple[np.ndarray | None, float | None, float | None]:
        """Run all frames of ``truth``; return positions, position error and deformation error.

        All three are None if the run blew up.
        """
        frames = len(truth.reference) - 1
        found = self.run(frames, truth.scene.mesh.extent)
        return (None, None, None) if found is None else (found, *truth.errors(found, frames))

    def variant(
        self, labels: dict[str, Any], frames: int, starts: Starts = (), warm: int | None = None
    ) -> Variant:
        """Return a variant to time: ``frames`` frames, or one frame from each of ``starts``: pairs
        (state of all vertices, number of the next frame). A warm-up run has ``warm`` frames.
        """
        own, steps = tuple((self.state(s), self.steps * n) for s, n in starts), self.steps
        warm = None if warm is None else warm * steps
        return Variant(
            {**labels, **self.labels}, self.loop, self.start, frames * steps, output=self.output,
            steps=steps, starts=own, warm=warm,
        )  # fmt: skip


def full_order(
    scene: Scene, counts: Iterable[tuple[int, int]], meshes: Sequence[Coarser | None] = (None,)
) -> Iterator[Setting]:
    """Yield full-order settings of ``scene`` on each of ``meshes``; None is the scene's mesh.

    counts : pairs (iterations of a frame, window of Anderson acceleration or 0)
    """
    for mesh, (count, window) in product(meshes, counts):
        own = scene if mesh is None else mesh.scene
        names = (PLAIN, ANDERSON) if mesh is None else (COARSER, COARSER_ANDERSON)
        method = names[window > 0]
        labels = {"method": method, "iterations": count, "vertices": own.mesh.vertices}
        yield loop_of(labels, own.iterated(count, window), mesh)


def loop_of(
    labels: dict[str, Any], scene: Scene, mesh: Coarser | None = None, steps: int = 1
) -> Setting:
    """Return a setting with the step loop of ``scene``, built on the coarser ``mesh`` if given."""
    loop = scene.stepper(scene.system, track_objective=False)
    start = scene.initial_state()
    if mesh is None:
        return Setting(labels, loop, start, steps=steps)
    return Setting(labels, loop, start, mesh.positions, mesh.positions, mesh.state, steps)


def pareto(error: Sequence[float], cost: Sequence[float]) -> list[bool]:
    """Tell which points no other dominates, by being as good in both values and better in one."""
    return [
        not any((e <= a) & (c <= b) & ((e < a) | (c < b)) for e, c in zip(error, cost, strict=True))
        for a, b in zip(error, cost, strict=True)
    ]
