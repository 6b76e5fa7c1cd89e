"""Step loops of all methods for one scene, ready to be run and timed."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pdrom.experiments.alternatives.settings import (
    ACCELERATED,
    CONVERGED,
    OWN,
    REDUCTIONS,
    Comparison,
)
from pdrom.experiments.alternatives.solvers.anderson import WINDOW
from pdrom.experiments.alternatives.solvers.methods import alternative
from pdrom.experiments.kit.converged import converged_run
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
            self.loop.run, self.start, frames * self.steps, limit, extent, self.positions
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
    reduced: dict[str, list[tuple[int, int]]] = {}
    for method in settings.steps:
        pairs = settings.pairs(method, scene.mesh.vertices)
        if method in REDUCTIONS:
            reduced[method] = pairs
            continue
        for substeps, iterations in pairs:
            if substeps not in systems:
                step = scene.config.time_step / substeps
                systems[substeps] = GlobalSystem(scene.masses, step, scene.groups)
            system = systems[substeps]
            labels = {"method": method, "substeps": substeps, "iterations": iterations}
            loop = alternative(method, scene, substeps, iterations=iterations, system=system)
            yield Candidate(labels, loop, start)
    if any(reduced.values()):
        yield from _reduced(scene, training, settings, reduced)


def _reduced(
    scene: Scene,
    training: Scene,
    settings: Comparison,
    asked: Mapping[str, Sequence[tuple[int, int]]],
) -> Iterator[Candidate]:
    """Position subspace with sampled elements; columns and samples come from ``training``.

    The columns hold its frames as they are, or converged. The samples are trained on iterates of
    the training motion in these columns.
    """
    steps = [(m, n, count) for m, pairs in asked.items() for n, count in pairs]
    for trained_on, seen in _training_frames(training, settings):
        for k in settings.modes:
            columns = make_columns(training, seen, "pod", k=k)
            samples: dict[int, dict[str, Samples]] = {}
            for method, substeps, iterations in steps:
                if substeps not in samples:
                    samples[substeps] = _samples(training, columns, substeps, settings.tau)
                model = SubspaceModel("pod", columns, samples[substeps])
                window = WINDOW if method == ACCELERATED else 0
                loop, start = model.loop(substepped(scene, substeps, iterations, window))
                labels: dict[str, object] = {
                    "method": method,
                    "substeps": substeps,
                    "iterations": iterations,
                    "trained_on": trained_on,
                    "k": columns.modes,
                    "elements_sampled": model.elements_evaluated(scene),
                }
                yield Candidate(labels, loop, start, substeps, model.positions)


def _training_frames(training: Scene, settings: Comparison) -> Iterator[tuple[str, np.ndarray]]:
    """Frames (F, N, 3) m of each kind that is asked for and can be had."""
    for kind in settings.trained_on:
        if kind == OWN:
            yield kind, trajectory(training, track_objective=False)[1:]
        elif settings.affords(CONVERGED, training.mesh.vertices):
            own = settings.implicit
            found = converged_run(training, own.tolerance, own.limit)
            if found is not None:
                yield kind, found[1:]


def _samples(training: Scene, columns: Columns, substeps: int, tau: float) -> dict[str, Samples]:
    own = substepped(training, substeps, training.config.iterations)
    ends = np.arange(substeps - 1, own.config.frames, substeps)
    (found,) = sample_elements(own, columns, ends, tolerances=[tau])
    return found


def substepped(scene: Scene, substeps: int, iterations: int, window: int = 0) -> Scene:
    """The scene with ``substeps`` frames for one, of ``iterations``; schedules keep their seconds.

    ``window`` iterates accelerate the others.
    """
    config = scene.config
    changes = {
        "time_step": config.time_step / substeps,
        "frames": substeps * config.frames,
        "iterations": iterations,
        "anderson_window": window,
        "effects": tuple(e.with_frames_scaled(substeps) for e in config.effects),
    }
    if substeps == 1:
        return replace(scene, config=config.model_copy(update=changes))
    return Scene.build(config.model_copy(update=changes), scene.mesh, masses=scene.masses)
