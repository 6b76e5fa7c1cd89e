"""Time full-order and reduced runs, single local steps, and effects.

`timing` uses the mesh of a scene; `scaling` times iterations on meshes of other sizes.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import sparse

from pdrom.core.store import open_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import group_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.sampling.local_step import ReducedLocalStep
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.snapshots import recorded
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.training import make_columns, sampled_models
from pdrom.reduction.timing import Variant, measure, model_variant
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Settings, SourcesOf
from study.experiments.iterations import IterationCounts
from study.experiments.iterations import settings as full_order_settings
from study.experiments.kit import base as kit
from study.experiments.kit.costs import effect_costs, left_out, local_costs, variant
from study.experiments.kit.measurement import Protocol
from study.experiments.kit.models import stored_models


class NumpyLocalStep:
    """Local step by vectorised NumPy projections of all elements and SciPy sparse products.

    The time of the products with S^T is added up separately, in ``assembly_seconds``.
    """

    def __init__(self, group: ConstraintGroup) -> None:
        self.group = group = group.for_run()
        self.name, self.begin_frame, self.assembly_seconds = group.name, group.begin_frame, 0.0
        self._shape = (group.elements, group.rows_per_element, 3)
        self._weights = group.row_weights[:, None]
        self._lift = sparse.csr_array(group.S.T.multiply(group.row_weights[None, :]))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p to ``rhs``, with projections p at ``y`` (N, 3) m; return the energy, J."""
        d, every = self.group.S @ y, np.arange(self.group.elements)
        p = self.group.reference_project(d.reshape(self._shape), every).reshape(d.shape)
        energy = 0.5 * float(np.sum(self._weights * (d - p) ** 2))
        before = perf_counter()
        rhs += self._lift @ p
        self.assembly_seconds += perf_counter() - before
        return energy


class InterpretedLocalStep(NumpyLocalStep):
    """Local step by interpreted Python code that projects one element after the other."""

    def __init__(self, group: ConstraintGroup) -> None:
        super().__init__(group)
        rows = group.rows_per_element
        self._blocks = []
        for e in range(group.elements):
            block = group.S[rows * e : rows * (e + 1)]
            columns = np.unique(block.indices)
            self._blocks.append((columns, block.toarray()[:, columns], group.weights[e]))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        energy = 0.0
        for e, (columns, block, weight) in enumerate(self._blocks):
            d = block @ y[columns]
            p = self.group.reference_project(d[None], np.array([e]))[0]
            energy += 0.5 * weight * float(np.sum((d - p) ** 2))
            before = perf_counter()
            rhs[columns] += weight * (block.T @ p)
            self.assembly_seconds += perf_counter() - before
        return energy


# Name -> implementation of a local step that is timed in addition to the compiled local step.
IMPLEMENTATIONS = {"numpy": NumpyLocalStep, "interpreted": InterpretedLocalStep}


log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "iterations", "vertices",
    "implementation", "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms",
    "global_ms", "vertices_ms",
]  # fmt: skip
ITERATIONS = [
    "scene", "method", "vertices", "elements", "r", "k", "elements_sampled",
    "ms_per_iteration", "local_ms", "global_ms", "vertices_ms", "local_share",
]  # fmt: skip
# Methods whose local steps are timed on meshes of increasing size; the method whose runs are timed;
# the tolerance of the energy-conserving sampling that is timed, too.
SCALED, METHOD, TOLERANCE = ("deim-joint", "block-deim"), "block-deim", 1e-2
STATES, SIZED_STATES = 5, 4  # numbers of frames in which `timing` and `scaling` time local steps
TrainingFrames = Annotated[int, Field(ge=3, le=1000)]


class Timing(Protocol):
    """Section ``timing``: numbers of frames, iterations and repeats in timing jobs.

    ``breakeven`` are sizes r of reduced local steps that are timed outside of runs.
    """

    numpy_frames: kit.Count = 4
    interpreted_frames: kit.Count = 1
    interpreted_iterations: Annotated[int, Field(ge=1)] = 2
    breakeven: tuple[kit.Rank, ...] = (5, 10, 20, 40, 60, 80, "full")
    breakeven_repeats: Annotated[int, Field(ge=5)] = 20


class Options(ConfigModel):
    """Settings of the experiment `timing` for one scene."""

    scene: SceneConfig
    methods: dict[str, MethodSpec]
    ranks: tuple[kit.Rank, ...]
    iterations: IterationCounts
    timing: Timing


@kit.experiment(
    "Timings of {scene}",
    reads={
        "mesh": paths.MESH,
        "fom": paths.TRAIN,
        "bases": Every(paths.BASIS),
        "samplings": Every(paths.SAMPLING),
        "subspaces": Every(paths.SUBSPACES),
        "settings": Settings(Options),
    },
    writes={
        "out": paths.TIMINGS,
        "breakeven": paths.BREAK_EVEN,
        "effects": paths.EFFECTS,
        "without": paths.LEFT_OUT,
    },
    alone=True,
)
def timing(mesh: File, fom: File, settings: Options, **files: Any) -> None:
    """Time frames, local steps and effects, and frames of scenes that lack an effect."""
    scene, asked = kit.scene_of(settings.scene, mesh), settings.timing
    name, frames = scene.config.name, min(asked.frames, scene.config.frames)
    common = {"scene": name, "vertices": scene.mesh.vertices, "implementation": "compiled"}
    common["iterations"] = scene.config.iterations
    slow, quick = _full_order(scene, frames, asked, common)
    quick += _other_settings(scene, frames, settings.iterations, common)
    alone: dict[tuple[str, str, int], ReducedLocalStep] = {}
    sizes = (*settings.ranks, *asked.breakeven)
    given = files["samplings"], files["bases"], settings.methods, sizes, files["subspaces"]
    for labels, model in stored_models(*given):
        if isinstance(model, SubspaceModel):
            labels = common | {"iterations": None} | labels
            quick.append(model_variant(labels, scene, model, frames))
        elif model is not None:
            reduction, r = model.reduction, labels["r"]
            if r in kit.resolve_ranks(settings.ranks, reduction.basis.rank):
                quick.append(model_variant(common | labels, scene, model, frames))
            by_itself = r in kit.resolve_ranks(asked.breakeven, reduction.basis.rank)
            if by_itself and reduction.spec.rows != "all":
                step = ReducedLocalStep(scene.group(model.group), reduction)
                alone[model.group, labels["method"], r] = step
    log.info("%s: %d runs of %d frames", name, len(quick) + 1, frames)
    results = measure(quick, asked.warmup, asked.repeats) + measure([slow], 0, asked.repeats)
    write_table(pd.DataFrame(results, columns=COLUMNS), files["out"].path)
    log.info("%s: %d reduced local steps alone", name, len(alone))
    often = {"warmup": asked.warmup, "repeats": asked.breakeven_repeats}
    with open_hdf5(fom.path) as file:  # take `STATES` frames, spread evenly over the run
        positions = file["positions"]
        ends = [positions[i * (len(positions) - 1) // STATES] for i in range(STATES)]
    times = local_costs(scene, alone, np.stack(ends), **often)
    write_table(times.assign(factor=1.0), files["breakeven"].path)
    log.info("%s: effects", name)
    often = {"warmup": asked.warmup, "repeats": asked.repeats}
    write_table(costs := effect_costs(scene, frames, **often), files["effects"].path)
    without = left_out(scene, costs, frames, **often)
    write_table(without, files["without"].path)


def _full_order(
    scene: Scene, frames: int, asked: Timing, common: dict[str, Any]
) -> tuple[Variant, list[Variant]]:
    """Return full-order runs to time: that in interpreted code (fewer iterations); all others."""
    made = [variant(scene, frames, common)]
    for name, step in IMPLEMENTATIONS.items():
        steps = [step(group) for group in scene.groups]
        fewer = min(frames, getattr(asked, f"{name}_frames"))
        made.append(variant(scene, fewer, {**common, "implementation": name}, steps))
    slow, whole = made.pop(), scene.config.count
    slow.loop.iterations = min(whole, asked.interpreted_iterations)
    return replace(slow, share=slow.loop.iterations / whole), made


def _other_settings(
    scene: Scene, frames: int, asked: IterationCounts, common: dict[str, Any]
) -> list[Variant]:
    """Return full-order runs with other iterations, acceleration or meshes than the scene's."""
    own = {"method": kit.FOM, **{key: common[key] for key in ("iterations", "vertices")}}
    return [
        each.variant(common, frames)
        for each in full_order_settings(scene, asked)
        if each.labels != own
    ]


class SizedBreakEven(ConfigModel):
    """Settings of reduced local steps (sizes r) that are timed outside of runs, on every mesh."""

    sizes: tuple[kit.Modes, ...] = (5, 10, 20, 40, 80)
    training_frames: TrainingFrames = 84
    repeats: kit.Repeats = 20


class Sized(Protocol):
    """Settings of the timing on one mesh size.

    Two models are trained on ``training_frames`` frames and timed: a reduced local step with r
    modes, and energy-conserving sampling in a position subspace with k modes.
    """

    r: kit.Modes = 10
    k: kit.Modes = 20
    training_frames: TrainingFrames = 16
    repeats: kit.Repeats = 5
    breakeven: SizedBreakEven = SizedBreakEven()


class Scaling(Sized):
    """Section ``scaling``; ``scenes``: scene -> factors of the number of vertices along a side."""

    scenes: kit.Sizes = Field(default_factory=dict)


class SizedOptions(ConfigModel):
    """Settings of the experiment `scaling` for one scene and mesh size."""

    scene: SceneConfig
    scaled_methods: dict[str, MethodSpec]
    scaling: Sized


@kit.experiment(
    "Cost of {scene} on a mesh with {factor} times the vertices along a side",
    reads={"sources": SourcesOf("scene.mesh"), "settings": Settings(SizedOptions)},
    writes={"iterations": paths.SCALING, "breakeven": paths.BREAK_EVEN_SIZED},
    alone=True,
)
def scaling(sources: list[Path], settings: SizedOptions, iterations: File, breakeven: File) -> None:
    """Time a scene on its mesh, refined by the label "factor" of the output files."""
    config, sized = settings.scene, settings.scaling
    specs, alone = settings.scaled_methods, settings.scaling.breakeven
    factor = float(iterations["factor"])
    config = config.coarsened(factor, 1.0)
    scene = Scene.build(config, config.mesh.build(Path()))
    group, few = scene.groups[0], sized.training_frames
    many, start = max(few, alone.training_frames), scene.initial_state()
    positions, projections, roundoff = recorded(scene, group.name, start, many)
    positions = positions[1:]
    columns = make_columns([scene], positions[:few], sized.k)
    trained_on = np.arange(len(positions[:few]))
    (model,) = sampled_models([scene], columns, trained_on, [TOLERANCE])
    inside = {"k": columns.modes, "elements_sampled": model.elements_evaluated(scene)}
    (reduction,) = _reductions(scene, projections[:few], roundoff[:few], specs[METHOD], [sized.r])
    sampled = {"r": reduction.r, "elements_sampled": len(reduction.elements)}
    local = ProjectionModel(group.name, reduction)
    variants = [
        variant(scene, sized.frames, {"method": kit.FOM}),
        model_variant({"method": METHOD, **sampled}, scene, local, sized.frames),
        model_variant({"method": "ecsw", **inside}, scene, model, sized.frames),
    ]
    times = pd.DataFrame(measure(variants, sized.warmup, sized.repeats)).assign(
        scene=config.name,
        vertices=scene.mesh.vertices,
        elements=sum(group.elements for group in scene.groups),
        ms_per_iteration=lambda own: own.ms_per_frame / config.iterations,
        local_ms=lambda own: (own.local_ms + own.assembly_ms + own.lift_ms) / config.iterations,
        global_ms=lambda own: own.global_ms / config.iterations,
        vertices_ms=lambda own: own.vertices_ms / config.iterations,
        local_share=lambda own: own.local_ms / own.ms_per_iteration,
    )
    write_table(times[ITERATIONS], iterations.path)
    few = alone.training_frames
    reduced = {
        (group.name, name, own.r): ReducedLocalStep(group, own)
        for name in SCALED
        for own in _reductions(scene, projections[:few], roundoff[:few], specs[name], alone.sizes)
    }
    states = positions[:: len(positions) // SIZED_STATES][:SIZED_STATES]
    costs = local_costs(scene, reduced, states, warmup=sized.warmup, repeats=alone.repeats)
    write_table(costs.assign(factor=factor), breakeven.path)
    log.info("%s: %d vertices done", config.name, scene.mesh.vertices)


def _reductions(
    scene: Scene, p: np.ndarray, roundoff: np.ndarray, spec: MethodSpec, asked: Sequence[int]
) -> list[Reduction]:
    """Reduce the first group to r modes (at most the rank of the basis) for each r ``asked``."""
    noise = float(np.linalg.norm(roundoff))
    basis = group_basis(scene.groups[0], scene.masses, p, noise, spec)
    sizes = sorted({min(r, basis.rank) for r in asked})
    return list(reductions(basis, spec, sizes).values())
