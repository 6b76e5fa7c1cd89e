"""Step loops of all methods for one scene, ready to be run and timed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pdrom.experiments.alternatives.settings import REDUCED, Comparison
from pdrom.experiments.alternatives.solvers.methods import alternative
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.runs.bounded import BoundedRun
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.model import Samples, SubspaceModel, make_columns, sample_elements


@dataclass(frozen=True)
class Candidate:
    """A method with its settings.

    steps : how many times the loop steps in a frame
    positions : vertex positions of the coordinates of the loop
    """

    labels: dict[str, object]
    loop: Stepper
    start: State
    steps: int = 1
    positions: Callable[[np.ndarray], np.ndarray] = field(default=lambda y: y)

    def run(self, frames: int, limit: float, extent: float) -> np.ndarray | None:
        """Positions (F + 1, N, 3) at the ends of frames, the initial ones first.

        None if it is not finite, or larger than ``limit`` times the ``extent`` (m).
        """
        run = BoundedRun(
            self.loop.step, self.start, frames * self.steps, limit, extent, self.positions
        )
        found = [self.positions(self.start.positions)]
        found += [f.positions for f in run if (f.number + 1) % self.steps == 0]
        return None if run.blowup_frame is not None else np.stack(found)


def candidates(scene: Scene, training: Scene, settings: Comparison) -> Iterator[Candidate]:
    """Every method with each of its settings, on the motion of ``scene``.

    ``training`` is the motion that the reduction has seen.
    """
    systems: dict[int, GlobalSystem] = {}
    start = scene.initial_state()
    for method in settings.steps:
        pairs = settings.pairs(method, scene.mesh.vertices)
        if method == REDUCED:
            yield from _reduced(scene, training, settings, pairs)
            continue
        for substeps, iterations in pairs:
            if substeps not in systems:
                step = scene.config.time_step / substeps
                systems[substeps] = GlobalSystem(scene.masses, step, scene.groups)
            system = systems[substeps]
            labels = {"method": method, "substeps": substeps, "iterations": iterations}
            loop = alternative(method, scene, substeps, iterations=iterations, system=system)
            yield Candidate(labels, loop, start)


def _reduced(
    scene: Scene, training: Scene, settings: Comparison, pairs: Sequence[tuple[int, int]]
) -> Iterator[Candidate]:
    """Position subspace with sampled elements; columns and samples come from ``training``."""
    if not pairs:
        return
    seen = trajectory(training, track_objective=False)[1:]
    for k in settings.modes:
        columns = make_columns(training, seen, "pod", k=k)
        samples: dict[int, dict[str, Samples]] = {}
        for substeps, iterations in pairs:
            if substeps not in samples:
                samples[substeps] = _samples(training, columns, substeps, settings.tau)
            model = SubspaceModel("pod", columns, samples[substeps])
            loop, start = model.loop(substepped(scene, substeps, iterations))
            labels: dict[str, object] = {
                "method": REDUCED,
                "substeps": substeps,
                "iterations": iterations,
                "k": columns.modes,
                "elements_sampled": model.elements_evaluated(scene),
            }
            yield Candidate(labels, loop, start, substeps, model.positions)


def _samples(training: Scene, columns: Columns, substeps: int, tau: float) -> dict[str, Samples]:
    own = substepped(training, substeps, training.config.iterations)
    ends = np.arange(substeps - 1, own.config.frames, substeps)
    (found,) = sample_elements(own, columns, ends, tolerances=[tau])
    return found


def substepped(scene: Scene, substeps: int, iterations: int) -> Scene:
    """The scene with shorter frames: the same schedules in seconds."""
    config = scene.config
    changes = {
        "time_step": config.time_step / substeps,
        "frames": substeps * config.frames,
        "iterations": iterations,
        "anderson_window": 0,
        "effects": tuple(e.with_frames_scaled(substeps) for e in config.effects),
    }
    if substeps == 1:
        return replace(scene, config=config.model_copy(update=changes))
    return Scene.build(config.model_copy(update=changes), scene.mesh, masses=scene.masses)
