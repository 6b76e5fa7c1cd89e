"""Full-order and reduced iterations of one scene on growing meshes."""

import ctypes
import gc
import logging
import os
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import pandas as pd
import psutil
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select, select_path
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.snapshots import row_masses
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements
from study.artifact.paths import BREAK_EVEN_SIZED, EFFECTS_SIZED, SCALING, File
from study.artifact.reads import Settings, SourcesOf
from study.experiments.kit.costs import effect_costs, local_costs, variant
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import Measurement, Protocol, Variant, measure
from study.experiments.kit.settings import FOM, Modes, Repeats, Solver, Tolerance

log = logging.getLogger(__name__)

ITERATIONS = [
    "scene", "method", "vertices", "elements", "r", "k", "elements_sampled",
    "factorisation_ms", "memory_mb", "ms_per_iteration", "local_ms", "global_ms", "local_share",
]  # fmt: skip
STATES = 4  # states of the training run at which local steps are timed alone
TrainingFrames = Annotated[int, Field(ge=3, le=1000)]


@dataclass(frozen=True)
class Training:
    """Positions (n, N, 3) m after the training frames, and projections (n, e p, 3) within them.

    ``roundoff`` (n,) is that of the projections.
    """

    positions: np.ndarray
    projections: np.ndarray
    roundoff: np.ndarray

    def first(self, frames: int) -> "Training":
        """Keep the first frames only."""
        return Training(self.positions[:frames], self.projections[:frames], self.roundoff[:frames])


class SizedBreakEven(ConfigModel):
    """Reduced local steps timed alone on every mesh size: methods, sizes r, short repeats.

    Bases come from the first ``training_frames`` frames.
    """

    methods: tuple[str, ...] = ("deim-joint", "block-deim")
    sizes: tuple[Modes, ...] = (5, 10, 20, 40, 80)
    training_frames: TrainingFrames = 84
    repeats: Repeats = 20


class Sized(Protocol):
    """Cost on one mesh size.

    ``training_frames`` frames train ``method`` with r modes (only the local step reduced) and
    energy-conserving sampling to ``tolerance`` with k modes; ``frames`` are timed.
    """

    method: str = "block-deim"
    r: Modes = 10
    k: Modes = 20
    tolerance: Tolerance = 1e-2
    training_frames: TrainingFrames = 16
    repeats: Repeats = 9
    breakeven: SizedBreakEven = SizedBreakEven()


class Scaling(Sized):
    """Section ``scaling``: factors on the vertices along a side for each of ``scenes``."""

    scenes: dict[str, tuple[Annotated[float, Field(gt=0.0, le=100.0)], ...]] = Field(
        default_factory=dict
    )


class Options(ConfigModel):
    """Settings of the costs on a mesh size."""

    scene: SceneConfig
    scaled_methods: dict[str, MethodSpec]
    scaling: Sized
    solver: Solver


@experiment(
    "Cost of {scene} on a mesh with {factor} times the vertices along a side",
    reads={"sources": SourcesOf("scene.mesh"), "settings": Settings(Options)},
    writes={"iterations": SCALING, "breakeven": BREAK_EVEN_SIZED, "effects": EFFECTS_SIZED},
    alone=True,
)
def scaling(
    sources: list[Path], settings: Options, iterations: File, breakeven: File, effects: File
) -> None:
    """Measure a scene on one mesh: ``factor`` times the vertices along each side."""
    config, solver, sized = settings.scene, settings.solver, settings.scaling
    specs, alone = settings.scaled_methods, settings.scaling.breakeven
    factor = float(iterations["factor"])
    # libraries and kernels are loaded before anything is measured
    _factorised(Scene.build(config, config.mesh.build(Path())), solver)
    config = config.coarsened(factor, 1.0)
    scene = Scene.build(config, config.mesh.build(Path()))
    idle = _memory()
    system, seconds = _factorised(scene, solver)
    measured = {"factorisation_ms": 1e3 * seconds, "memory_mb": _memory() - idle}
    training = train(scene, system, max(sized.training_frames, alone.training_frames))
    first = training.first(sized.training_frames)
    basis = _basis(scene, first, specs[sized.method])
    variants = [
        variant(scene, system, scene.groups, sized.frames, {"method": FOM, **measured}),
        _reduced(scene, system, basis, specs[sized.method], sized),
        _subspace(scene, first, sized),
    ]
    results = measure(variants, sized.warmup, sized.repeats)
    rows = [{"scene": config.name, **m.labels, **_times(scene, m)} for m in results]
    write_table(pd.DataFrame(rows, columns=ITERATIONS), iterations.path)
    costs = effect_costs(scene, system, sized.frames, warmup=sized.warmup, repeats=sized.repeats)
    write_table(costs, effects.path)
    steps = _steps_alone(scene, training.first(alone.training_frames), specs, alone)
    states = training.positions[:: len(training.positions) // STATES][:STATES]
    times = local_costs(scene, steps, states, warmup=sized.warmup, repeats=alone.repeats)
    write_table(times.assign(factor=factor), breakeven.path)
    log.info("%s: %d vertices done", config.name, scene.mesh.vertices)


def _factorised(scene: Scene, solver: str) -> tuple[GlobalSystem, float]:
    """Global system, and the seconds that its assembly and first factorisation take."""
    state = scene.initial_state()
    started = perf_counter()
    system = scene.system_with(solver)
    fixed, _ = scene.space(system).fixed(0, state.positions)
    system.eliminate(fixed)
    return system, perf_counter() - started


def _basis(scene: Scene, training: Training, spec: MethodSpec) -> Basis:
    group = scene.groups[0]
    mass, rows = row_masses(group, scene.masses), group.rows_per_element
    roundoff = float(np.linalg.norm(training.roundoff))
    return compute_basis(training.projections, mass, roundoff, rows_per_element=rows, spec=spec)


def _steps_alone(
    scene: Scene, training: Training, specs: dict[str, MethodSpec], settings: SizedBreakEven
) -> dict[tuple[str, str, int], ReducedLocalStep]:
    """Local steps of the first group by group, method and size, as far as the rank allows."""
    group, steps = scene.groups[0], {}
    for name in settings.methods:
        spec, basis = specs[name], _basis(scene, training, specs[name])
        sizes = sorted({min(r, basis.rank) for r in settings.sizes})
        for size, sampling in select_path(basis, spec, sizes).items():
            reduction = Reduction(basis, sampling, spec, r=size)
            steps[group.name, name, size] = ReducedLocalStep(group, reduction)
    return steps


def _reduced(
    scene: Scene, system: GlobalSystem, basis: Basis, spec: MethodSpec, settings: Sized
) -> Variant:
    group, method = scene.groups[0], settings.method
    size = min(settings.r, basis.rank)
    reduction = Reduction(basis, select(basis, spec, size), spec, r=size)
    steps = replace_group(scene, group.name, ReducedLocalStep(group, reduction))
    labels = {"r": reduction.r, "elements_sampled": len(reduction.elements)}
    return variant(scene, system, steps, settings.frames, {"method": method, **labels})


def _subspace(scene: Scene, training: Training, settings: Sized) -> Variant:
    columns = make_columns(scene, training.positions, "pod", k=settings.k)
    frames = np.arange(len(training.positions))
    (samples,) = sample_elements(scene, columns, frames, tolerances=[settings.tolerance])
    model = SubspaceModel("pod", columns, samples)
    labels = {
        "method": "ecsw",
        "k": columns.modes,
        "elements_sampled": model.elements_evaluated(scene),
    }
    return Variant(labels, *model.loop(scene), settings.frames)


def _times(scene: Scene, measured: Measurement) -> dict[str, Any]:
    """Mean milliseconds of an iteration."""
    local = (measured.local + measured.assembly) / scene.config.iterations
    solve = measured.solve / scene.config.iterations
    return {
        "vertices": scene.mesh.vertices,
        "elements": sum(group.elements for group in scene.groups),
        "ms_per_iteration": measured.frame / scene.config.iterations,
        "local_ms": local,
        "global_ms": solve,
        "local_share": local / (local + solve),
    }


def _memory() -> float:
    """Resident memory of this process, in MB, after what is free went back to the system."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if os.name == "posix" else None
    if trim is not None:  # glibc; elsewhere small sizes may fit into free memory
        trim(0)
    return psutil.Process().memory_info().rss / 1e6


def train(scene: Scene, system: GlobalSystem, frames: int) -> Training:
    """First ``frames`` of the full-order run of ``scene`` with the matrix of ``system``.

    The projections are those at the last local iterates.
    """
    group = scene.groups[0]
    loop, state = scene.stepper(system, track_objective=False), scene.initial_state()
    positions, projections, roundoff = [], [], []

    def watch(y: np.ndarray) -> None:
        projections.append(group.project(y))
        roundoff.append(group.roundoff(y))

    for frame in range(frames):
        state, _ = loop.step(state, frame, watch)
        positions.append(state.positions)
    return Training(np.stack(positions), np.stack(projections), np.array(roundoff))
