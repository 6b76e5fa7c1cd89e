"""Milliseconds a frame of full-order and reduced runs, of local steps alone, and of effects."""

import logging
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import sparse

from pdrom.core.store import open_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import load_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from pdrom.reduction.subspace.model import load_models
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Settings
from study.experiments.iterations import IterationCounts, accelerated, stepper_of
from study.experiments.kit.costs import effect_costs, left_out, local_costs, variant
from study.experiments.kit.declaration import experiment
from study.experiments.kit.measurement import Protocol, Variant, measure
from study.experiments.kit.reruns import basis_of, load_reduction
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import ANDERSON, FOM, Count, Rank, Solver, resolve_ranks


class NumpyLocalStep:
    """Vectorised NumPy projections of all elements, SciPy sparse products around them.

    The time of the products with S^T is counted separately, here as in the other implementation.
    """

    def __init__(self, group: ConstraintGroup) -> None:
        self.name, self.group, self.begin_frame = group.name, group, group.begin_frame
        self.assembly_seconds = 0.0
        self._shape = (group.elements, group.rows_per_element, 3)
        self._all = np.arange(group.elements)
        self._weights = group.row_weights[:, None]
        self._lift = sparse.csr_array(group.S.T.multiply(group.row_weights[None, :]))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3) and return the energy, J."""
        d = self.group.S @ y
        p = self.group.reference_project(d.reshape(self._shape), self._all).reshape(d.shape)
        energy = 0.5 * float(np.sum(self._weights * (d - p) ** 2))
        before = perf_counter()
        rhs += self._lift @ p
        self.assembly_seconds += perf_counter() - before
        return energy


class InterpretedLocalStep:
    """One element after the other in interpreted Python, as straightforward codes do it."""

    def __init__(self, group: ConstraintGroup) -> None:
        self.name, self.group, self.begin_frame = group.name, group, group.begin_frame
        self.assembly_seconds = 0.0
        rows = group.rows_per_element
        self._blocks = []
        for e in range(group.elements):
            block = group.S[rows * e : rows * (e + 1)]
            columns = np.unique(block.indices)
            self._blocks.append((columns, block.toarray()[:, columns], group.weights[e]))

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3) and return the energy, J."""
        energy = 0.0
        for e, (columns, block, weight) in enumerate(self._blocks):
            d = block @ y[columns]
            p = self.group.reference_project(d[None], np.array([e]))[0]
            energy += 0.5 * weight * float(np.sum((d - p) ** 2))
            before = perf_counter()
            rhs[columns] += weight * (block.T @ p)
            self.assembly_seconds += perf_counter() - before
        return energy


# Makers of a local step of the step loop, by name.
IMPLEMENTATIONS: dict[str, Callable[[ConstraintGroup], Any]] = {
    "numpy": NumpyLocalStep,
    "interpreted": InterpretedLocalStep,
}


log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "iterations", "vertices",
    "implementation", "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms",
    "global_ms",
]  # fmt: skip
STATES = 5  # states of the full-order run at which local steps are timed alone


class Timing(Protocol):
    """Section ``timing``: the protocol of the timing jobs.

    The slow implementations of the full-order run are timed over fewer frames, the interpreted one
    over fewer iterations, too. ``breakeven`` are the sizes r of the reduced local steps that are
    timed alone, in ``breakeven_repeats`` short repeats.
    """

    numpy_frames: Count = 4
    interpreted_frames: Count = 1
    interpreted_iterations: Annotated[int, Field(ge=1)] = 2
    breakeven: tuple[Rank, ...] = (5, 10, 20, 40, 60, 80, "full")
    breakeven_repeats: Annotated[int, Field(ge=5)] = 20


class Options(ConfigModel):
    """Settings of the times of a scene."""

    scene: SceneConfig
    methods: dict[str, MethodSpec]
    ranks: tuple[Rank, ...]
    iterations: IterationCounts
    timing: Timing
    solver: Solver


@experiment(
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
def timing(
    mesh: File,
    fom: File,
    bases: list[File],
    samplings: list[File],
    subspaces: list[File],
    settings: Options,
    out: File,
    breakeven: File,
    effects: File,
    without: File,
) -> None:
    """Measure frames (``out``), local steps alone, effects, and frames ``without`` each of them."""
    scene, asked = scene_of(settings.scene, mesh), settings.timing
    system, name = scene.system_with(settings.solver), scene.config.name
    frames = min(asked.frames, scene.config.frames)
    common = {"scene": name, "vertices": scene.mesh.vertices, "iterations": scene.config.iterations}
    slow, quick = _full_order(scene, system, frames, asked, common)
    quick += _other_counts(scene, system, frames, settings.iterations, common)
    alone: dict[tuple[str, str, int], ReducedLocalStep] = {}
    for sampling in samplings:
        spec = settings.methods[sampling["method"]]
        basis = load_basis(basis_of(sampling, spec, bases).path)
        with open_hdf5(sampling.path) as stored:  # sizes that the file holds
            held = {int(key[1:]) for key in stored if key.startswith("r")}
        timed = held.intersection(resolve_ranks(settings.ranks, basis.rank))
        sizes = held.intersection(resolve_ranks(asked.breakeven, basis.rank))
        sizes = set() if spec.rows == "all" else sizes
        group = scene.group(sampling["group"])
        for r in sorted(timed | sizes):
            reduction = load_reduction(basis, sampling.path, spec, r=r)
            step = ReducedLocalStep(group, reduction)
            if r in timed:
                own = {"group": group.name, "method": sampling["method"], "r": r}
                labels = {**common, **own, "implementation": "compiled"}
                steps = replace_group(scene, group.name, step)
                quick.append(variant(scene, system, steps, frames, labels))
            if r in sizes:
                alone[group.name, sampling["method"], r] = step
    for file in subspaces:
        for own, model in load_models(file.path):
            labels = {**common, "iterations": None, "implementation": "compiled", "group": "all"}
            quick.append(Variant({**labels, **own}, *model.loop(scene), frames))
    log.info("%s: %d runs of %d frames", name, len(quick) + 1, frames)
    results = measure(quick, asked.warmup, asked.repeats) + measure([slow], 0, asked.repeats)
    write_table(pd.DataFrame(results, columns=COLUMNS), out.path)
    log.info("%s: %d reduced local steps alone", name, len(alone))
    often = {"warmup": asked.warmup, "repeats": asked.breakeven_repeats}
    times = local_costs(scene, alone, _states(fom), **often)
    write_table(times.assign(factor=1.0), breakeven.path)
    log.info("%s: effects", name)
    often = {"warmup": asked.warmup, "repeats": asked.repeats}
    write_table(costs := effect_costs(scene, system, frames, **often), effects.path)
    write_table(left_out(scene, costs, frames, **often, solver=settings.solver), without.path)


def _full_order(
    scene: Scene, system: GlobalSystem, frames: int, asked: Timing, common: dict[str, Any]
) -> tuple[Variant, list[Variant]]:
    """The full-order run in the slowest implementation, of some iterations only, and in others."""
    quick = variant(scene, system, scene.groups, frames, {**common, "implementation": "compiled"})
    made = [quick]
    for name, step in IMPLEMENTATIONS.items():
        steps = [step(group) for group in scene.groups]
        fewer = min(frames, getattr(asked, f"{name}_frames"))
        labels = {**common, "implementation": name}
        made.append(variant(scene, system, steps, fewer, labels))
    slow, whole = made.pop(), scene.config.iterations
    slow.loop.iterations = min(whole, asked.interpreted_iterations)
    return replace(slow, share=slow.loop.iterations / whole), made


def _other_counts(
    scene: Scene,
    system: GlobalSystem,
    frames: int,
    asked: IterationCounts,
    common: dict[str, Any],
) -> list[Variant]:
    """The compiled full-order run with other numbers of iterations, plain and accelerated."""
    variants = []
    counts = sorted({*asked.counts, scene.config.iterations})
    own = (scene.config.iterations, scene.config.anderson_window)
    for count, size in accelerated(counts, asked.anderson_window):
        if (count, size) != own:
            loop = stepper_of(scene, system, count, window=size)
            method = ANDERSON if size else FOM
            labels = {"method": method, "iterations": count, "implementation": "compiled"}
            variants.append(Variant({**common, **labels}, loop, scene.initial_state(), frames))
    return variants


def _states(run: File) -> np.ndarray:
    """Positions (n, N, 3) spread over a full-order run."""
    with open_hdf5(run.path) as file:
        positions = file["positions"]
        return np.stack([positions[i * (len(positions) - 1) // STATES] for i in range(STATES)])
