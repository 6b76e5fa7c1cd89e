"""Step loops of all methods for one scene, ready to be run and timed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.runs import BoundedRun, trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements
from study.experiments.alternatives.settings import (
    ACCELERATED,
    CONVERGED,
    OWN,
    REDUCTIONS,
    TRAINED,
    TWO_LEVEL,
    Comparison,
)
from study.experiments.alternatives.solvers.projective import WINDOW
from study.experiments.alternatives.solvers.substeps import alternative
from study.experiments.alternatives.solvers.two_level import TwoLevel
from study.experiments.kit.converged import converged_run


@dataclass(frozen=True)
class Trained:
    """A reduced ``model`` for frames of so many ``substeps``, and the frames it is trained on.

    It is a ``coarse`` level, or a reduction.
    """

    trained_on: str
    substeps: int
    model: SubspaceModel
    coarse: bool = False


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


def candidates(
    scene: Scene, models: Sequence[Trained], settings: Comparison
) -> Iterator[Candidate]:
    """The methods that have steps in ``settings``, with each of these, on the motion of ``scene``.

    ``models`` are what `trained` made of another motion.
    """
    systems: dict[int, GlobalSystem] = {}
    start = scene.initial_state()
    reduced: list[tuple[str, int, int]] = []
    for method in settings.steps:
        pairs = settings.pairs(method, scene.mesh.vertices)
        if method in TRAINED:
            reduced += [(method, *pair) for pair in pairs]
            continue
        for substeps, iterations in pairs:
            if substeps not in systems:
                step = scene.config.time_step / substeps
                systems[substeps] = GlobalSystem(scene.masses, step, scene.groups)
            system = systems[substeps]
            labels = {"method": method, "substeps": substeps, "iterations": iterations}
            loop = alternative(method, scene, substeps, iterations=iterations, system=system)
            yield Candidate(labels, loop, start)
    for own in models:
        for method, substeps, iterations in reduced:
            if substeps == own.substeps and own.coarse == (method == TWO_LEVEL):
                yield _reduced(scene, own, method, iterations)


def _reduced(scene: Scene, own: Trained, method: str, iterations: int) -> Candidate:
    labels: dict[str, object] = {
        "method": method,
        "substeps": own.substeps,
        "iterations": iterations,
        "trained_on": own.trained_on,
        "k": own.model.columns.modes,
        "elements_sampled": own.model.elements_evaluated(scene),
    }
    if own.coarse:
        level = TwoLevel(scene, own.substeps, iterations, own.model)
        return Candidate(labels, level, scene.initial_state())
    window = WINDOW if method == ACCELERATED else 0
    loop, start = own.model.loop(substepped(scene, own.substeps, iterations, window))
    return Candidate(labels, loop, start, own.substeps, own.model.positions)


def trained(training: Scene, settings: Comparison) -> Iterator[Trained]:
    """Position subspaces with sampled elements; columns and samples come from ``training``.

    The columns hold its frames as they are, or converged. The samples are trained on iterates of
    the training motion in these columns, for every number of substeps that a reduction takes. Of
    converged frames there is a coarse level, too, with more samples.
    """
    vertices, own = training.mesh.vertices, settings.implicit
    taken, coarse = (
        sorted({n for m in methods for n, _ in settings.pairs(m, vertices)})
        for methods in (REDUCTIONS, (TWO_LEVEL,))
    )
    for trained_on in settings.trained_on if taken or coarse else ():
        run: np.ndarray | None = None
        if trained_on == OWN:
            run = trajectory(training, track_objective=False)
        elif settings.affords(CONVERGED, vertices):
            run = converged_run(training, own.tolerance, own.limit)
        if run is None:
            continue
        for k in settings.modes:
            columns = make_columns(training, run[1:], "pod", k=k)
            for substeps in sorted({*taken, *coarse}):
                level = trained_on == CONVERGED and substeps in coarse
                tolerances = [settings.tau, *([settings.coarse_tau] if level else [])]
                scene = substepped(training, substeps, training.config.iterations)
                ends = np.arange(substeps - 1, scene.config.frames, substeps)
                made = sample_elements(scene, columns, ends, tolerances=tolerances)
                for tau, samples in dict(zip(tolerances, made, strict=True)).items():
                    model = SubspaceModel("pod", columns, samples)
                    yield Trained(trained_on, substeps, model, coarse=tau != settings.tau)


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
    return scene.changed(**changes)
