"""Time of every method on one scene, and its errors against two references.

The first reference is the scene's implicit time step, solved to convergence, which methods approach
with more iterations. The second is the motion in continuous time: a user wants this motion, and the
implicit step deviates from it. All methods run the held-out motions; only subspaces are trained.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Annotated, Any, Final, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.held_out import FIRST, MOTIONS, PLAYBACK
from pdrom.model.runs import BLOWUP_EXTENT, BoundedRun, converged_run, trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import projector, reduced_state
from pdrom.reduction.subspace.training import make_columns, sampled_models
from pdrom.reduction.timing import Variant
from study.artifact.paths import ALTERNATIVE_TIMES, ALTERNATIVES, File
from study.artifact.reads import Setting, SourcesOf
from study.experiments.alternatives.solvers.methods import WINDOW, TwoLevel, continuous
from study.experiments.alternatives.solvers.substeps import METHODS
from study.experiments.kit import base as kit
from study.experiments.kit import runfiles
from study.experiments.kit.base import experiment
from study.experiments.kit.measurement import Processes, in_processes

REDUCED, ACCELERATED = REDUCTIONS = "ecsw", "ecsw-anderson"  # names of the reduced methods
TWO_LEVEL: Final = "two-level"  # full-order method whose coarse level is a trained subspace
TRAINED: Final = (TWO_LEVEL, *REDUCTIONS)
CONVERGED: Final = "converged"  # name of the reference: the implicit step solved to convergence
TRAINING: Final = "training"  # key in `Comparison.work` for runs on which reductions are trained

# Columns of tables that together identify a candidate (a method with its settings) in a scene.
SETTING: Final = ["method", "substeps", "iterations", "training_motions", "k"]

Factors = Annotated[tuple[Annotated[float, Field(gt=0.0, le=1e8)], ...], Field(min_length=1)]
Work = Annotated[int, Field(ge=1, le=10**12, description="vertices times steps")]
Steps = Annotated[
    tuple[kit.Count, kit.Count], Field(description="substeps of a frame, iterations of each")
]
Method = Literal[
    "projective", "anderson", "chebyshev", "explicit", "two-level", "ecsw", "ecsw-anderson"
]


# The motion in continuous time is computed by explicit steps, `EXPLICIT_STEPS` per frame in the
# first run, and halved until the estimated error is below `CONTINUOUS_TOLERANCE`.
EXPLICIT_STEPS, CONTINUOUS_TOLERANCE = 40, 1e-4
# Frames of training runs converge to this part of the mesh; projections are evaluated up to `MOST`
# times in a frame, also of the implicit reference, whose error a `FINER` times finer solve tells.
TRAINING_TOLERANCE, MOST, FINER = 1e-5, 4000, 100.0
# Sampling tolerances of reductions, and of the coarse level of the two-level method.
TAU, COARSE_TAU = 1e-2, 5e-3


class ContinuousReference(ConfigModel):
    """Largest product (``limit``) of vertices and explicit steps of a frame."""

    limit: Work = 2_400_000


class ImplicitReference(ConfigModel):
    """Tolerance of the converged implicit step, over the longest side of the mesh."""

    tolerance: kit.Tolerance = 1e-7


class Comparison(Processes):
    """Settings of the comparison of methods on one scene and one mesh.

    Each of ``processes`` new processes times ``frames`` frames of the first held-out motion.

    stiffness : scene -> factors by which its groups' weights are multiplied; 1 without an entry
    steps : method -> pairs (substeps of a frame, iterations of each substep)
    work : method -> largest product vertices x substeps x iterations (for ``training``: vertices x
        motions); runs with more work are left out
    modes : numbers of modes of reductions
    training_motions : numbers of motions on which reductions are trained, the scene's motion first
    """

    stiffness: dict[str, Factors] = Field(default_factory=dict)
    steps: dict[Method, tuple[Steps, ...]] = Field(default_factory=dict)
    work: dict[Method | Literal["converged", "training"], Work] = Field(default_factory=dict)
    modes: Annotated[tuple[kit.Modes, ...], Field(min_length=1)] = (40,)
    training_motions: Annotated[
        tuple[Annotated[int, Field(ge=1, le=64)], ...], Field(min_length=1)
    ] = (1, 2, 4, 8)
    implicit: ImplicitReference = ImplicitReference()
    continuous: ContinuousReference = ContinuousReference()
    frames: kit.Count = 20
    repeats: kit.Repeats = 1

    def factors(self, scene: str, size: float) -> tuple[float, ...]:
        """Factors of groups' weights in ``scene``; just (1.0,) unless ``size`` of its mesh is 1."""
        return self.stiffness.get(scene, (1.0,)) if size == 1.0 else (1.0,)

    def pairs(self, method: Any, vertices: int) -> list[tuple[int, int]]:
        """Pairs (substeps, iterations) of ``method`` that `affords` allows for ``vertices``."""
        steps = self.steps.get(method, ())
        return [(n, k) for n, k in steps if self.affords(method, vertices * n * k)]

    def affords(self, method: Any, work: int) -> bool:
        """Whether ``work`` (vertices x substeps x iterations) is within the limit of ``method``."""
        return work <= self.work.get(method, work)


class Alternatives(Comparison):
    """Section ``alternatives`` of the configuration.

    scenes : scene -> factors by which its mesh gets more vertices along a side, with equal mass
    errors : largest allowed errors; the table ``winners`` has a row for each of them
    """

    scenes: kit.Sizes = Field(default_factory=dict)
    errors: tuple[kit.Tolerance, ...] = (1e-1, 1e-2, 1e-3)


TIME_COLUMNS = ["scene", "factor", "stiffness", *SETTING, "process", "ms_per_frame", "vertices_ms"]
log = logging.getLogger(__name__)
COLUMNS = [
    "scene", "factor", "vertices", "stiffness", "method", "substeps", "iterations",
    "training_motions", "offline_s", "k", "elements_sampled", "training_residual", "motion",
    "frames", "finite", "error_implicit", "deformation_error", "error_continuous", "span_error",
    "reference_error", "implicit_error", "implicit_deformation_error",
]  # fmt: skip


@dataclass(frozen=True)
class Trained:
    """A reduced model, trained on a number of motions, for a number of substeps of a frame.

    seconds : processor time of the training and of its full-order runs, s
    coarse : whether the model is the coarse level of the two-level method
    """

    motions: int
    substeps: int
    model: SubspaceModel
    seconds: float
    coarse: bool = False


@dataclass(frozen=True)
class Candidate:
    """A method with its settings, ready to run on one scene.

    steps : number of steps (frames of ``loop``) into which a frame of the scene is divided
    model : the reduction in whose position subspace the method runs; None without one
    """

    labels: dict[str, object]
    loop: Stepper
    start: State
    steps: int = 1
    model: SubspaceModel | None = None

    def state(self, state: State, scene: Scene) -> State:
        """Convert ``state`` of all vertices to coordinates in the method's subspace, if any."""
        return state if self.model is None else reduced_state(scene, self.model.columns, state)

    def run(self, frames: int, extent: float) -> np.ndarray | None:
        """Run the method; return positions (F + 1, N, 3) m at the start and at the ends of frames.

        None is returned if the run is not finite, or if a side of its bounding box exceeds
        `BLOWUP_EXTENT` times the ``extent`` (m).
        """
        loop, steps, limit = self.loop.run, frames * self.steps, BLOWUP_EXTENT
        positions = (lambda y: y) if self.model is None else self.model.positions
        run = BoundedRun(loop, self.start, steps, limit, extent, positions)
        found = [positions(self.start.positions)]
        found += [f.positions for f in run if (f.number + 1) % self.steps == 0]
        return None if run.blowup_frame is not None else np.stack(found)


def candidates(
    scene: Scene, models: Sequence[Trained], settings: Comparison
) -> Iterator[Candidate]:
    """Yield every method with each pair (substeps, iterations) in ``settings``, for ``scene``.

    ``models`` were trained by `trained` on other motions than that of ``scene``.
    """
    systems: dict[int, GlobalSystem] = {}
    start, reduced = scene.initial_state(), []
    for method in settings.steps:
        for substeps, iterations in settings.pairs(method, scene.mesh.vertices):
            labels = dict[str, object](method=method, substeps=substeps, iterations=iterations)
            if method in TRAINED:
                reduced.append((method, substeps, iterations, labels))
                continue
            if substeps not in systems:
                step = scene.config.time_step / substeps
                systems[substeps] = GlobalSystem(scene.masses, step, scene.groups)
            loop = METHODS.load(method)(scene, substeps, iterations, systems[substeps])
            yield Candidate(labels, loop, start)
    for own in models:
        sizes: dict[str, object] = {"training_motions": own.motions, "k": own.model.columns.modes}
        sizes |= {"offline_s": own.seconds, "elements_sampled": own.model.elements_evaluated(scene)}
        sizes["training_residual"] = own.model.residual
        for method, substeps, iterations, labels in reduced:
            if substeps != own.substeps or own.coarse != (method == TWO_LEVEL):
                continue
            if own.coarse:
                level = TwoLevel(scene, substeps, iterations, own.model)
                yield Candidate(labels | sizes, level, start)
                continue
            window = WINDOW if method == ACCELERATED else 0
            other = substepped(scene, substeps, iterations, window)
            yield Candidate(labels | sizes, *own.model.loop(other), substeps, own.model)


def trained(training: Scene, settings: Comparison) -> Iterator[Trained]:
    """Yield models in position subspaces with sampled elements, trained on one or more motions.

    The first motion is that of ``training``, others are random variants of it. POD modes of every
    n-th converged frame of n motions span a subspace; its elements are sampled once for each number
    of substeps. The coarse level of the two-level method is trained only for the smallest n.
    """
    vertices = training.mesh.vertices
    taken, coarse = (
        sorted({n for m in methods for n, _ in settings.pairs(m, vertices)})
        for methods in (REDUCTIONS, (TWO_LEVEL,))
    )
    scenes, runs, spent = [training], list[np.ndarray](), 0.0
    for count in sorted(settings.training_motions) if taken or coarse else ():
        if not settings.affords(TRAINING, count * vertices):
            continue
        started = process_time()
        while len(scenes) < count:
            further = training.config.training_variant(len(scenes))
            scenes.append(Scene.build(further, training.mesh))
        for scene in scenes[len(runs) :]:
            run = converged_run(scene, TRAINING_TOLERANCE, MOST)
            if run is None:
                log.warning("%s: a training motion does not converge", training.config.name)
                return
            runs.append(run[1:])
        spent += process_time() - started
        for k in settings.modes:
            started = process_time()
            frames = np.concatenate([run[::count] for run in runs])
            columns = make_columns([training], frames, k)
            in_columns = process_time() - started
            for substeps in sorted({*taken, *coarse}):
                started = process_time()
                level = count == min(settings.training_motions) and substeps in coarse
                tolerances = [TAU, *([COARSE_TAU] if level else [])]
                split = [substepped(s, substeps, s.config.iterations) for s in scenes]
                ends = np.arange(substeps - 1, split[0].config.frames, substeps)
                made = sampled_models(split, columns, ends, tolerances)
                seconds = spent + in_columns + process_time() - started
                for tau, model in dict(zip(tolerances, made, strict=True)).items():
                    yield Trained(count, substeps, model, seconds, coarse=tau != TAU)


def substepped(scene: Scene, substeps: int, iterations: int, window: int = 0) -> Scene:
    """Return the scene with each frame split into ``substeps`` frames of ``iterations`` each.

    Effects keep their times in seconds. ``window`` is the number of iterates in Anderson
    acceleration, 0 for none.
    """
    config = scene.config
    if substeps > 1:
        scene = scene.changed(
            time_step=config.time_step / substeps,
            frames=substeps * config.frames,
            effects=tuple(e.with_frames_scaled(substeps) for e in config.effects),
        )
    return scene.iterated(iterations, window)


@dataclass(frozen=True)
class Timed:
    """A scene with the motion to time, its reduced models, and ``labels`` of the measured times."""

    labels: dict[str, object]
    scene: Scene
    models: tuple[Trained, ...]
    settings: Comparison

    def variants(self) -> Iterator[Variant]:
        """Yield the step loops of all methods with all settings, to be timed."""
        scene, wanted = self.scene, min(self.settings.frames, self.scene.config.frames)
        places = np.linspace(0, scene.config.frames - 1, wanted).round().astype(int)
        # One frame for each set of active boundary conditions comes first: an unmeasured run of
        # these factorises all matrices, so that no measured frame has to.
        held = [tuple(b.active(frame) for b in scene.boundaries) for frame in places]
        first = [held.index(kind) for kind in dict.fromkeys(held)]
        places = np.concatenate([places[first], np.delete(places, first)])
        loop, states = scene.stepper(track_objective=False), [scene.initial_state()]
        states += [end for end, _ in loop.run(states[0], range(scene.config.frames))]
        for each in candidates(scene, self.models, self.settings):
            labels = {**self.labels, **each.labels, "steps": each.steps}
            output = None if each.model is None else each.model.output()
            starts = tuple((each.state(states[f], scene), f * each.steps) for f in places)
            yield Variant(
                labels, each.loop, each.start, wanted * each.steps, steps=each.steps, starts=starts,
                output=output, warm=len(first) * each.steps,
            )  # fmt: skip


@experiment(
    "Alternatives to projective dynamics in {scene} with {factor} times the vertices along a side",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "section": Setting("alternatives"),
    },
    writes={"out": ALTERNATIVES, "times": ALTERNATIVE_TIMES},
    alone=True,
)
def alternatives(
    sources: list[Path], config: SceneConfig, section: Comparison, out: File, times: File
) -> None:
    """Compare all methods on the mesh with ``out["factor"]`` times the vertices along a side."""
    factor = float(out["factor"])
    rows, cases = [], []
    for stiffness in section.factors(config.name, factor):
        finer = sized(config, factor, stiffness)
        training = Scene.build(finer, finer.mesh.build(Path()))
        models = tuple(trained(training, section))
        recorded = trajectory(training, track_objective=False)
        own = {"scene": config.name, "factor": factor, "stiffness": stiffness}
        for motion in MOTIONS:
            scene = Scene.build(finer.heldout_variant(motion), training.mesh)
            for row in _rows(scene, recorded, models, section):
                rows.append({**own, "motion": motion, **row})
            if motion == FIRST:
                cases.append(Timed(own, scene, models, section).variants)
        log.info("%s: stiffness %g done", config.name, stiffness)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)
    measured = pd.DataFrame(in_processes(cases, section))
    measured[["ms_per_frame", "vertices_ms"]] *= measured.steps.to_numpy()[:, None]
    write_table(measured.reindex(columns=TIME_COLUMNS), times.path)


def sized(config: SceneConfig, factor: float, stiffness: float) -> SceneConfig:
    """Refine the mesh by ``factor`` with equal mass, and multiply all weights by ``stiffness``."""
    finer = config.coarsened(factor, 1.0)
    counts = [c.mesh.build(Path()).vertices for c in (config, finer)]
    effects = tuple(
        e.model_copy(update={"weight": stiffness * e.weight}) if isinstance(e, GroupConfig) else e
        for e in finer.effects
    )
    mass = config.vertex_mass * counts[0] / counts[1]
    return finer.model_copy(update={"vertex_mass": mass, "effects": effects})


def _rows(
    scene: Scene, recorded: np.ndarray, models: tuple[Trained, ...], section: Comparison
) -> Iterator[dict[str, Any]]:
    """Yield rows with errors of runs in the motion of ``scene``, one row for each run.

    The first is the converged implicit step, the second the ``recorded`` training motion, shown
    instead. Errors against the implicit step are None if a frame of it did not converge or its work
    exceeds the limit in ``section``. Runs that blew up have no errors (None) at all.
    """
    name, vertices = scene.config.name, scene.mesh.vertices
    frames, implicit = scene.config.frames, None
    limit = section.continuous.limit // vertices
    exact = continuous(scene, frames, CONTINUOUS_TOLERANCE, EXPLICIT_STEPS, limit)
    log.info("%s: %d explicit steps a frame, error %.1e", name, exact.substeps, exact.error)
    if not exact.error <= CONTINUOUS_TOLERANCE:
        log.warning("%s: motion in continuous time is known to %.1e only", name, exact.error)
    if section.affords(CONVERGED, vertices):
        implicit = converged_run(scene, section.implicit.tolerance, MOST)
        if implicit is None:
            log.warning("%s: no convergence in %d evaluations", name, MOST)
    common = {"vertices": vertices, "frames": frames, "reference_error": exact.error}
    if implicit is not None:
        yardstick = Yardstick(scene, implicit)
        common |= _own_errors(scene, implicit, section.implicit.tolerance / FINER)

    def errors(run: np.ndarray | None) -> dict[str, float | None]:
        if run is None:
            return {}
        position, shape = (None, None) if implicit is None else yardstick.errors(run, frames)
        total = runfiles.run_error(run, exact.positions)
        return {"error_implicit": position, "deformation_error": shape, "error_continuous": total}

    yield {**common, "method": CONVERGED, "substeps": 1, "finite": True, **errors(implicit)}
    yield {**common, "method": PLAYBACK, "substeps": 1, "finite": True, **errors(recorded)}
    spans: dict[int, float | None] = {}
    for candidate in candidates(scene, models, section):
        with np.errstate(over="ignore", invalid="ignore"):
            reached = candidate.run(frames, scene.mesh.extent)
        row = {**common, **candidate.labels, "finite": reached is not None, **errors(reached)}
        if implicit is not None and candidate.model is not None:
            own = candidate.model.columns
            if id(own) not in spans:
                project = projector(own, scene.masses)
                nearest = np.stack([own.B @ (project @ q) for q in implicit])
                spans[id(own)] = runfiles.run_error(nearest, implicit)
            row["span_error"] = spans[id(own)]
        yield row


def _own_errors(scene: Scene, run: np.ndarray, tolerance: float) -> dict[str, Any]:
    """Errors of the converged ``run`` against a finer one, on sheets from other starting points."""
    finer = converged_run(scene, tolerance, MOST, from_last=not len(scene.mesh.tetrahedra))
    if finer is None:
        log.warning("%s: no convergence to %g in %d steps", scene.config.name, tolerance, MOST)
        return {}
    errors = Yardstick(scene, finer).errors(run, scene.config.frames)
    return dict(zip(("implicit_error", "implicit_deformation_error"), errors, strict=True))
