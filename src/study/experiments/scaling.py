"""Full-order and reduced iterations of one scene on growing meshes."""

import ctypes
import gc
import logging
import os
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Annotated

import numpy as np
import pandas as pd
import psutil
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.snapshots import row_masses
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements
from study.artifact.paths import BREAK_EVEN_SIZED, SCALING, File
from study.artifact.reads import Settings, SourcesOf
from study.experiments.kit.costs import local_costs, variant
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import Protocol, Variant, measure
from study.experiments.kit.settings import FOM, Modes, Repeats, Solver, Tolerance

log = logging.getLogger(__name__)

ITERATIONS = [
    "scene", "method", "vertices", "elements", "r", "k", "elements_sampled",
    "factorisation_ms", "memory_mb", "ms_per_iteration", "local_ms", "global_ms", "local_share",
]  # fmt: skip
STATES = 4  # states of the training run at which local steps are timed alone
TrainingFrames = Annotated[int, Field(ge=3, le=1000)]


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
    writes={"iterations": SCALING, "breakeven": BREAK_EVEN_SIZED},
    alone=True,
)
def scaling(sources: list[Path], settings: Options, iterations: File, breakeven: File) -> None:
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
    group, few = scene.groups[0], sized.training_frames
    positions, projections, roundoff = _training(scene, system, max(few, alone.training_frames))
    columns = make_columns(scene, positions[:few], "pod", k=sized.k)
    trained_on = np.arange(len(positions[:few]))
    (samples,) = sample_elements(scene, columns, trained_on, tolerances=[sized.tolerance])
    model = SubspaceModel("pod", columns, samples)
    inside = {"k": columns.modes, "elements_sampled": model.elements_evaluated(scene)}
    (reduction,) = _reductions(
        scene, projections[:few], roundoff[:few], specs[sized.method], [sized.r]
    )
    sampled = {"r": reduction.r, "elements_sampled": len(reduction.elements)}
    steps = replace_group(scene, group.name, ReducedLocalStep(group, reduction))
    variants = [
        variant(scene, system, scene.groups, sized.frames, {"method": FOM, **measured}),
        variant(scene, system, steps, sized.frames, {"method": sized.method, **sampled}),
        Variant({"method": "ecsw", **inside}, *model.loop(scene), sized.frames),
    ]
    times = pd.DataFrame(measure(variants, sized.warmup, sized.repeats)).assign(
        scene=config.name,
        vertices=scene.mesh.vertices,
        elements=sum(group.elements for group in scene.groups),
        ms_per_iteration=lambda own: own.ms_per_frame / config.iterations,
        local_ms=lambda own: (own.local_ms + own.assembly_ms) / config.iterations,
        global_ms=lambda own: own.global_ms / config.iterations,
        local_share=lambda own: own.local_ms / (own.local_ms + own.global_ms),
    )
    write_table(times[ITERATIONS], iterations.path)
    few = alone.training_frames
    reduced = {
        (group.name, name, own.r): ReducedLocalStep(group, own)
        for name in alone.methods
        for own in _reductions(scene, projections[:few], roundoff[:few], specs[name], alone.sizes)
    }
    states = positions[:: len(positions) // STATES][:STATES]
    costs = local_costs(scene, reduced, states, warmup=sized.warmup, repeats=alone.repeats)
    write_table(costs.assign(factor=factor), breakeven.path)
    log.info("%s: %d vertices done", config.name, scene.mesh.vertices)


def _factorised(scene: Scene, solver: str) -> tuple[GlobalSystem, float]:
    """Global system, and the seconds that its assembly and first factorisation take."""
    state = scene.initial_state()
    started = perf_counter()
    system = scene.system_with(solver)
    fixed, _ = scene.space(system).fixed(0, state.positions)
    system.eliminate(fixed)
    return system, perf_counter() - started


def _training(scene: Scene, system: GlobalSystem, frames: int) -> tuple[np.ndarray, ...]:
    """Positions (n, N, 3) m after the first n ``frames`` of the full-order run of ``scene``.

    Beside them the projections (n, e p, 3) of its first group at the last local iterates, and their
    roundoff (n,).
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
    return np.stack(positions), np.stack(projections), np.array(roundoff)


def _reductions(
    scene: Scene,
    projections: np.ndarray,
    roundoff: np.ndarray,
    spec: MethodSpec,
    asked: Sequence[int],
) -> list[Reduction]:
    """Reductions of the first group in sizes as large as ``asked``, as far as the rank allows."""
    group = scene.groups[0]
    basis = compute_basis(
        projections,
        row_masses(group, scene.masses),
        float(np.linalg.norm(roundoff)),
        rows_per_element=group.rows_per_element,
        spec=spec,
    )
    sizes = sorted({min(r, basis.rank) for r in asked})
    return list(reductions(basis, spec, sizes).values())


def _memory() -> float:
    """Resident memory of this process, in MB, after what is free went back to the system."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if os.name == "posix" else None
    if trim is not None:  # glibc; elsewhere small sizes may fit into free memory
        trim(0)
    return psutil.Process().memory_info().rss / 1e6
