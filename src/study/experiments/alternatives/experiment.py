"""Measure error and time of every setting that simulates a scene, on its mesh and coarser meshes.

The reference is the converged step of the scene, which methods approach with more iterations. All
settings run the test trajectories; only subspaces are trained. If a reduced model is to be chosen
for a scene, all settings also run validation trajectories.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from pathlib import Path
from time import process_time
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.coarser import Coarser, error_of_mesh, grids
from pdrom.model.held_out import MOTIONS, PLAYBACK
from pdrom.model.runs import converged_run, trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.settings import (
    ANDERSON,
    COARSER,
    COARSER_ANDERSON,
    PLAIN,
    Setting,
    Starts,
    loop_of,
)
from pdrom.reduction.subspace.model import SubspaceModel, reduced
from pdrom.reduction.subspace.training import make_columns, sampled_models
from pdrom.reduction.timing import Variant
from study.artifact.paths import ALTERNATIVE_TIMES, ALTERNATIVES, File
from study.artifact.reads import Setting as Configured
from study.artifact.reads import SourcesOf
from study.experiments.alternatives.solvers import (
    WINDOW,
    Chebyshev,
    TwoLevel,
    measured_rate,
)
from study.experiments.kit import base as kit
from study.experiments.kit.measurement import Processes, in_processes
from study.experiments.kit.runs import Row

SAMPLED, NEWTON = REDUCTIONS = "ecsw", "ecsw-newton"  # names of the reduced methods
TWO_LEVEL: Final = "two-level"  # full-order method with a trained subspace as coarse level
CONVERGED: Final = "converged"  # name of the reference: the converged step
COARSE: Final = (COARSER, COARSER_ANDERSON)
TRAINING: Final = "training"  # key in `Comparison.work` for training runs
ACCELERATED: Final = {PLAIN: 0, COARSER: 0, ANDERSON: WINDOW, COARSER_ANDERSON: WINDOW}

# Columns of tables that together identify a method with its settings in a scene.
SETTING: Final = [
    "method", "vertices", "substeps", "iterations", "training_motions", "k", "skinning",
    "tolerance",
]  # fmt: skip

Work = Annotated[int, Field(ge=1, le=10**12, description="vertices times steps")]
Steps = Annotated[
    tuple[kit.Count, kit.Count], Field(description="substeps of a frame, iterations of each")
]
Method = Literal[
    "projective", "anderson", "chebyshev", "chebyshev-power", "two-level",
    "coarser-mesh", "coarser-mesh-anderson",
]  # fmt: skip


# Tolerance of converged training runs relative to the longest side of the mesh; largest number of
# evaluations of the projections in a frame of training runs and of converged runs.
TRAINING_TOLERANCE, MOST = 1e-5, 4000
COARSE_TAU = 5e-3  # sampling tolerance of the coarse level of the two-level method
VALIDATION = 1_000_000  # first seed of validation trajectories; no training trajectory has it


class ImplicitReference(ConfigModel):
    """Tolerance of the converged step, relative to the longest side of the mesh.

    A run whose tolerance is smaller by the factor ``finer`` estimates the step's error.
    """

    tolerance: kit.Tolerance = 1e-7
    finer: Annotated[float, Field(ge=2.0, le=1e6)] = 100.0


class ReducedModel(ConfigModel):
    """A reduced model with sampled elements, numbers of training trajectories and of iterations.

    iterations, newton : numbers of local/global iterations and of Newton iterations of a frame
    """

    modes: kit.Modes = 40
    skinning: Annotated[int, Field(ge=0, le=1000)] = 0
    tolerance: kit.Tolerance = 1e-2
    training_motions: Annotated[tuple[Annotated[int, Field(ge=1, le=64)], ...], Field(min_length=1)]
    iterations: tuple[kit.Count, ...] = (5,)
    newton: tuple[kit.Count | Literal["converged"], ...] = ("converged",)

    @property
    def runs(self) -> Mapping[str, Sequence[int | None]]:
        """Method -> numbers of iterations; None: until convergence."""
        steps = [None if isinstance(count, str) else count for count in self.newton]
        return {SAMPLED: [*self.iterations], NEWTON: steps}

    @property
    def columns(self) -> tuple[int, int]:
        """Numbers of POD modes and of skinning columns."""
        return self.modes, self.skinning


class Comparison(Processes):
    """Settings of the comparison of methods on one scene and one mesh.

    Each of ``processes`` new processes times ``frames`` frames spread over each test trajectory.

    steps : method -> pairs (substeps of a frame, iterations of each substep); several substeps are
        allowed only for plain and accelerated iterations on the scene's mesh
    coarser : numbers of cells along a side of coarser meshes, relative to the scene's mesh
    work : method -> largest product vertices x substeps x iterations (for ``training``: vertices x
        trajectories); runs with more work are left out
    models : reduced models, whose first training trajectory is that of the scene
    choice : "scene/factor" -> models from which one is chosen, in place of ``models``
    seconds : simulated time of each run, s
    validation : number of validation trajectories, by which a model is chosen
    """

    steps: dict[Method, tuple[Steps, ...]] = Field(default_factory=dict)
    coarser: kit.Parts = (2 / 3, *kit.PARTS)
    work: dict[Method | Literal["converged", "training"], Work] = Field(default_factory=dict)
    models: tuple[ReducedModel, ...] = (ReducedModel(training_motions=(1, 2)),)
    choice: dict[str, tuple[ReducedModel, ...]] = Field(default_factory=dict)
    seconds: Annotated[float, Field(gt=0.0, le=1e4)] = 2.0
    validation: Annotated[int, Field(ge=0, le=64)] = 0
    implicit: ImplicitReference = ImplicitReference()
    frames: kit.Count = 10
    repeats: kit.Repeats = 1

    def pairs(self, method: Any, vertices: int) -> list[tuple[int, int]]:
        """List pairs (substeps, iterations) of ``method`` that `affords` allows on a mesh."""
        steps = self.steps.get(method, ())
        return [(n, k) for n, k in steps if self.affords(method, vertices * n * k)]

    def affords(self, method: Any, work: int) -> bool:
        """Return whether ``work`` (vertices x substeps x iterations) is allowed for ``method``."""
        return work <= self.work.get(method, work)


class Alternatives(Comparison):
    """Section ``alternatives``.

    scenes : scene -> factors of the number of vertices along a side; the total mass stays equal
    """

    scenes: kit.Sizes = Field(default_factory=dict)


log = logging.getLogger(__name__)
LABELS = ["scene", "factor", "stiffness", "motion"]
TIME_COLUMNS = [*LABELS, *SETTING, "process", "ms_per_frame", "vertices_ms"]
COLUMNS = [
    *LABELS, *SETTING, "offline_s", "elements_sampled", "training_residual", "frames", "finite",
    "error_implicit", "deformation_error", "implicit_error",
    "implicit_deformation_error", "mesh_error",
]  # fmt: skip


class Trained(NamedTuple):
    """A reduced model, trained on a number of trajectories, and its numbers of iterations.

    labels : columns of tables that describe the model
    iterations : method -> numbers of iterations; None: until convergence
    """

    labels: Row
    model: SubspaceModel
    iterations: Mapping[str, Sequence[int | None]]


@dataclass(frozen=True)
class Case:
    """A scene with one trajectory, its coarser meshes, its models, and the settings to compare."""

    labels: Row
    scene: Scene
    coarser: tuple[Coarser, ...]
    models: tuple[Trained, ...]
    section: Comparison

    def settings(self) -> Iterator[Setting]:
        """Yield every setting, ready to run; models were trained on other trajectories."""
        yield from self._full_order()
        for known, model, runs in self.models:
            for method, asked in ((m, count) for m, counts in runs.items() for count in counts):
                labels = {**known, "substeps": 1, "method": method, "iterations": asked}
                if method == TWO_LEVEL:
                    loop = TwoLevel(self.scene, asked or 1, model)
                    yield Setting(labels, loop, self.scene.initial_state())
                else:
                    yield reduced(labels, self.scene, model, asked, method == NEWTON)

    def _full_order(self) -> Iterator[Setting]:
        vertices = self.scene.mesh.vertices
        for method, window in ACCELERATED.items():
            coarse = method in COARSE
            meshes: tuple[Coarser | None, ...] = self.coarser if coarse else (None,)
            for mesh, (substeps, count) in product(meshes, self.section.pairs(method, vertices)):
                own = self.scene if mesh is None else mesh.scene
                labels = self._labels(method, substeps, count) | {"vertices": own.mesh.vertices}
                if substeps == 1:
                    yield loop_of(labels, own.iterated(count, window), mesh)
                elif not coarse:
                    split = substepped(own, substeps).iterated(count, window)
                    yield loop_of(labels, split, steps=substeps)
        scene, start = self.scene, self.scene.initial_state()
        for method in ("chebyshev", "chebyshev-power"):
            for _, count in self.section.pairs(method, vertices):
                loop = Chebyshev(scene, count)
                if method != loop.name:
                    loop.rate = self._measured_rate
                yield Setting(self._labels(method, 1, count), loop, start)

    @cached_property
    def _measured_rate(self) -> float:
        return measured_rate(self.scene)

    def _labels(self, method: str, substeps: int, iterations: int) -> Row:
        vertices = self.scene.mesh.vertices
        labels = {"method": method, "vertices": vertices, "substeps": substeps}
        return {**labels, "iterations": iterations}

    def starts(self) -> tuple[Starts, int]:
        """Return states from which single frames are timed, and the number of frames to warm up.

        One frame for each set of active boundary conditions comes first. They are run without being
        timed and factorise all matrices, so that no timed frame has to.
        """
        scene, wanted = self.scene, min(self.section.frames, self.scene.config.frames)
        places = np.linspace(0, scene.config.frames - 1, wanted).round().astype(int)
        held = [tuple(b.active(frame) for b in scene.boundaries) for frame in places]
        first = [held.index(kind) for kind in dict.fromkeys(held)]
        places = np.concatenate([places[first], np.delete(places, first)])
        loop, states = scene.stepper(track_objective=False), [scene.initial_state()]
        states += [end for end, _ in loop.run(states[0], range(scene.config.frames))]
        return tuple((states[frame], int(frame)) for frame in places), len(first)

    def variants(self, starts: Starts, warm: int) -> Iterator[Variant]:
        """Yield the step loops of all settings, to time a frame from each of ``starts``."""
        for each in self.settings():
            yield each.variant(self.labels, len(starts), starts, warm)


def trained(training: Scene, section: Comparison) -> Iterator[Trained]:
    """Yield models with sampled elements in position subspaces, trained on several trajectories.

    The first trajectory is that of ``training``, others are random variants of it. POD modes of
    every n-th converged frame of n trajectories span a subspace, for which elements are sampled.
    The coarse level of the two-level method is trained on the first trajectory.
    """
    vertices = training.mesh.vertices
    scenes, runs, spent = [training], list[np.ndarray](), 0.0
    for count in sorted({n for model in section.models for n in model.training_motions}):
        if not section.affords(TRAINING, count * vertices):
            continue
        started = process_time()
        while len(scenes) < count:
            further = training.config.training_variant(len(scenes))
            scenes.append(Scene.build(further, training.mesh, training.masses))
        for scene in scenes[len(runs) :]:
            run = converged_run(scene, TRAINING_TOLERANCE, MOST)
            if run is None:
                log.warning("%s: a training trajectory does not converge", training.config.name)
                return
            runs.append(run[1:])
        spent += process_time() - started
        frames = np.concatenate([run[::count] for run in runs])
        asked = [model for model in section.models if count in model.training_motions]
        for modes, skinning in dict.fromkeys(model.columns for model in asked):
            started = process_time()
            columns = make_columns([training], frames, modes, skinning)
            own = [model for model in asked if model.columns == (modes, skinning)]
            trials = [(each.tolerance, each.runs) for each in own]
            if count == 1 and section.steps.get(TWO_LEVEL) and own[0] is section.models[0]:
                few = [own for _, own in section.pairs(TWO_LEVEL, vertices)]
                trials.append((COARSE_TAU, {TWO_LEVEL: few}))
            tolerances = [tolerance for tolerance, _ in trials]
            made = sampled_models(scenes, columns, np.arange(len(runs[0])), tolerances)
            seconds = spent + process_time() - started
            log.info("%d trajectories, %d + %d columns: %.0f s", count, modes, skinning, seconds)
            for (tolerance, iterations), model in zip(trials, made, strict=True):
                labels: Row = {
                    "vertices": vertices, "training_motions": count, "k": columns.modes,
                    "skinning": skinning, "tolerance": tolerance, "offline_s": seconds,
                    "elements_sampled": model.elements_evaluated(training),
                    "training_residual": model.residual,
                }  # fmt: skip
                yield Trained(labels, model, iterations)


def substepped(scene: Scene, substeps: int) -> Scene:
    """Split each frame of ``scene`` into ``substeps``; effects begin and end at the same times."""
    config = scene.config
    return scene.changed(
        time_step=config.time_step / substeps,
        frames=substeps * config.frames,
        effects=tuple(e.with_frames_scaled(substeps) for e in config.effects),
    )


@kit.experiment(
    "Alternatives to projective dynamics in {scene} with {factor} times the vertices along a side",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Configured("scene"),
        "section": Configured("alternatives"),
    },
    writes={"out": ALTERNATIVES, "times": ALTERNATIVE_TIMES},
    alone=True,
)
def alternatives(
    sources: list[Path], config: SceneConfig, section: Comparison, out: File, times: File
) -> None:
    """Compare all settings on the mesh with ``out["factor"]`` times the vertices along a side."""
    factor, rows, timed = float(out["factor"]), [], []
    chosen = section.choice.get(f"{config.name}/{factor:g}")
    section = section.model_copy(update={"models": chosen or section.models})
    finer = sized(config, factor)
    finer = finer.model_copy(update={"frames": round(section.seconds / finer.time_step)})
    training = Scene.build(finer, finer.mesh.build(Path()))
    models = tuple(trained(training, section))
    recorded = trajectory(training, track_objective=False)
    configs = {str(motion): finer.heldout_variant(motion) for motion in MOTIONS}
    for number in range(section.validation if chosen else 0):
        configs[f"validation_{number + 1}"] = finer.training_variant(VALIDATION + number)
    for motion, variant in configs.items():
        scene = Scene.build(variant, training.mesh, training.masses)
        labels = {"scene": config.name, "factor": factor, "stiffness": 1.0, "motion": motion}
        case = Case(labels, scene, tuple(grids(scene, section.coarser)), models, section)
        rows += [{**labels, **row} for row in _rows(case, recorded, motion in MOTIONS)]
        if motion in MOTIONS:
            timed.append(partial(case.variants, *case.starts()))
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)
    measured = pd.DataFrame(in_processes(timed, section))
    write_table(measured.reindex(columns=TIME_COLUMNS), times.path)


def sized(config: SceneConfig, factor: float) -> SceneConfig:
    """Refine the mesh of ``config`` by ``factor``, with equal mass."""
    finer = config.coarsened(factor, 1.0)
    counts = [c.mesh.build(Path()).vertices for c in (config, finer)]
    mass = config.vertex_mass * counts[0] / counts[1]
    return finer.model_copy(update={"vertex_mass": mass})


def _rows(case: Case, recorded: np.ndarray, test: bool) -> Iterator[Row]:
    """Yield a row with errors for each run of the trajectory of ``case``.

    The first rows are those of the converged step on all meshes, and of replaying the ``recorded``
    training trajectory. Errors are None for runs that blew up, and for all runs if the converged
    step did not converge or exceeds the limit of work. Only for a ``test`` trajectory, the error of
    the converged step is estimated.
    """
    scene, section = case.scene, case.section
    frames, implicit = scene.config.frames, None
    common: Row = {"frames": frames}
    tolerance = section.implicit.tolerance
    if section.affords(CONVERGED, scene.mesh.vertices):
        implicit = converged_run(scene, tolerance, MOST)
        if implicit is None:
            log.warning("%s: no convergence in %d evaluations", scene.config.name, MOST)
    truth = None if implicit is None else Yardstick(scene, implicit)
    if truth is not None and test:
        common |= _own_errors(truth, tolerance / section.implicit.finer)

    def errors(run: np.ndarray | None) -> Row:
        found = (None, None) if run is None or truth is None else truth.errors(run, frames)
        return dict(zip(("error_implicit", "deformation_error"), found, strict=True))

    own = {"substeps": 1, "finite": True, "vertices": scene.mesh.vertices, **common}
    coarse = [mesh.converged(tolerance, MOST) for mesh in case.coarser]
    estimated = error_of_mesh(implicit, case.coarser, coarse)
    yield {**own, "method": CONVERGED, "mesh_error": estimated, **errors(implicit)}
    for mesh, run in zip(case.coarser, coarse, strict=True):
        yield {**own, "method": CONVERGED, "vertices": mesh.scene.mesh.vertices, **errors(run)}
    yield {**own, "method": PLAYBACK, **errors(recorded)}
    for setting in case.settings():
        reached = setting.run(frames, scene.mesh.extent)
        yield {**common, **setting.labels, "finite": reached is not None, **errors(reached)}


def _own_errors(truth: Yardstick, tolerance: float) -> Row:
    """Return errors of the converged run against a finer run, which starts otherwise on sheets."""
    scene, frames = truth.scene, truth.scene.config.frames
    finer = converged_run(scene, tolerance, MOST, from_last=not len(scene.mesh.tetrahedra))
    if finer is None:
        log.warning("%s: no convergence to %g in %d steps", scene.config.name, tolerance, MOST)
        return {}
    errors = Yardstick(scene, finer).errors(truth.reference, frames)
    return dict(zip(("implicit_error", "implicit_deformation_error"), errors, strict=True))
