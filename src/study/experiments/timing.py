"""Milliseconds a frame of full-order and reduced runs, of local steps alone, and of effects."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import sparse

from pdrom.core.store import open_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import LocalStep
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
from study.experiments.kit.load_reduction import basis_of, load_reduction
from study.experiments.kit.measurement import Measurement, Protocol, Variant, measure
from study.experiments.kit.scenes import scene_of
from study.experiments.kit.settings import ANDERSON, FOM, Count, Rank, Solver, resolve_ranks


class _Slower:
    """Base of the implementations; the time of their products with S^T is counted separately."""

    implementation: str

    def __init__(self, group: ConstraintGroup) -> None:
        self.name = group.name
        self.group = group
        self.assembly_seconds = 0.0

    def begin_frame(self, q: np.ndarray) -> None:
        self.group.begin_frame(q)


class NumpyLocalStep(_Slower):
    """Vectorised NumPy projections of all elements, SciPy sparse products around them."""

    implementation = "numpy"

    def __init__(self, group: ConstraintGroup) -> None:
        super().__init__(group)
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


class InterpretedLocalStep(_Slower):
    """One element after the other in interpreted Python, as straightforward codes do it."""

    implementation = "interpreted"

    def __init__(self, group: ConstraintGroup) -> None:
        super().__init__(group)
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

Make = Callable[[dict[str, Any], Sequence[LocalStep]], Variant]
Alone = dict[tuple[str, str, int], ReducedLocalStep]

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "iterations", "vertices",
    "implementation", "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms",
    "global_ms", "repeats",
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
    scene = scene_of(settings.scene, mesh)
    system, asked = scene.system_with(settings.solver), settings.timing
    frames, name = min(asked.frames, scene.config.frames), scene.config.name
    variants, alone = _variants(scene, system, frames, settings, samplings, bases, subspaces)
    slow = [v for v in variants if v.labels["implementation"] == "interpreted"]
    quick = [v for v in variants if v.labels["implementation"] != "interpreted"]
    reported = partial(log.info, f"{name}: repeat %d of %d")
    results = measure(quick, asked.warmup, asked.repeats, progress=reported)
    results += measure(slow, 0, asked.repeats)
    write_table(pd.DataFrame([_row(scene, m) for m in results], columns=COLUMNS), out.path)
    log.info("%s: %d reduced local steps alone", name, len(alone))
    often = {"warmup": asked.warmup, "repeats": asked.breakeven_repeats}
    times = local_costs(scene, alone, _states(fom), **often)
    write_table(times.assign(factor=1.0), breakeven.path)
    log.info("%s: effects", name)
    often = {"warmup": asked.warmup, "repeats": asked.repeats}
    write_table(costs := effect_costs(scene, system, frames, **often), effects.path)
    write_table(left_out(scene, costs, frames, **often, solver=settings.solver), without.path)


def _variants(
    scene: Scene,
    system: GlobalSystem,
    frames: int,
    settings: Options,
    samplings: list[File],
    bases: list[File],
    subspaces: list[File],
) -> tuple[list[Variant], Alone]:
    """Everything whose frames are timed, and the reduced local steps that are timed alone."""

    def make(labels: dict[str, Any], steps: Sequence[LocalStep]) -> Variant:
        labels = {"iterations": scene.config.iterations, **labels}
        return variant(scene, system, steps, frames, labels)

    variants = _full_order(scene, make, settings.timing)
    variants += _other_counts(scene, system, frames, settings.iterations)
    alone: Alone = {}
    for sampling in samplings:
        group, method = sampling["group"], sampling["method"]
        source = _Source(scene.group(group), sampling, settings.methods[method], bases)
        for r in source.sizes(settings.ranks):
            step, labels = source.step(r), {"group": group, "method": method, "r": r}
            steps = replace_group(scene, group, step)
            variants.append(make({**labels, "implementation": "compiled"}, steps))
        if source.spec.rows != "all":
            for r in source.sizes(settings.timing.breakeven):
                alone[group, method, r] = source.step(r)
    for file in subspaces:
        for labels, model in load_models(file.path):
            labels = {"group": "all", **labels, "implementation": "compiled"}
            variants.append(Variant(labels, *model.loop(scene), frames))
    return variants, alone


class _Source:
    """Reduced local steps of one group and method, by size."""

    def __init__(
        self, group: ConstraintGroup, sampling: File, spec: MethodSpec, bases: list[File]
    ) -> None:
        self.spec = spec
        self._group, self._path = group, sampling.path
        self._space = load_basis(basis_of(sampling, spec, bases).path)
        with open_hdf5(sampling.path) as stored:
            self._stored = {int(key[1:]) for key in stored if key.startswith("r")}

    def sizes(self, asked: Sequence[Rank]) -> list[int]:
        """Requested sizes that the basis can have and the file holds."""
        return [r for r in resolve_ranks(asked, self._space.rank) if r in self._stored]

    def step(self, r: int) -> ReducedLocalStep:
        """Local step of size r."""
        reduction = load_reduction(self._space, self._path, self.spec, r=r)
        return ReducedLocalStep(self._group, reduction)


def _full_order(scene: Scene, make: Make, timing: Timing) -> list[Variant]:
    """The full-order run in every implementation; the slowest does only some iterations."""
    variants = [make({"implementation": "compiled"}, scene.groups)]
    for name, step in IMPLEMENTATIONS.items():
        made = make({"implementation": name}, [step(g) for g in scene.groups])
        frames = min(made.frames, getattr(timing, f"{name}_frames"))
        variants.append(replace(made, frames=frames))
    slow = variants[-1]
    whole = scene.config.iterations
    slow.loop.iterations = min(whole, timing.interpreted_iterations)
    variants[-1] = replace(slow, share=slow.loop.iterations / whole)
    return variants


def _other_counts(
    scene: Scene, system: GlobalSystem, frames: int, asked: IterationCounts
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
            variants.append(Variant(labels, loop, scene.initial_state(), frames))
    return variants


def _states(run: File) -> np.ndarray:
    """Positions (n, N, 3) spread over a full-order run."""
    with open_hdf5(run.path) as file:
        positions = file["positions"]
        return np.stack([positions[i * (len(positions) - 1) // STATES] for i in range(STATES)])


def _row(scene: Scene, measurement: Measurement) -> dict[str, Any]:
    return {
        "scene": scene.config.name,
        "vertices": scene.mesh.vertices,
        **measurement.labels,
        "ms_per_frame": measurement.frame,
        "inertia_ms": measurement.inertia,
        "local_ms": measurement.local,
        "assembly_ms": measurement.assembly,
        "lift_ms": measurement.lift,
        "global_ms": measurement.solve,
        "repeats": measurement.repeats,
    }
