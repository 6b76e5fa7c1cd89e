"""Rule timing: ms per frame of full-order and reduced runs, of local steps and of effects."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import open_hdf5, write_table
from pdrom.experiments.effect_costs import effect_costs, left_out
from pdrom.experiments.iterations import accelerated, stepper_of
from pdrom.experiments.local_costs import local_costs
from pdrom.experiments.measurement import LiftTimed, Measurement, Variant, measure
from pdrom.experiments.names import ANDERSON, FOM
from pdrom.experiments.scenes import scene_of
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.implementations import IMPLEMENTATIONS
from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from pdrom.reduction.basis import load_basis
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.ranks import resolve_ranks
from pdrom.reduction.local.rerun import replace_group
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.load import load_reduction
from pdrom.reduction.subspace.load import load_models

log = logging.getLogger(__name__)

Make = Callable[[dict[str, Any], Sequence[LocalStep]], Variant]

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "iterations", "vertices",
    "implementation", "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms",
    "global_ms", "spread_ms", "repeats",
]  # fmt: skip
STATES = 5  # states of the full-order run at which local steps are timed alone


def time_scene(
    scene: dict[str, Any],
    methods: dict[str, dict[str, Any]],
    ranks: list[int | str],
    counts: list[int],
    window: int,
    protocol: dict[str, Any],
    solver: str,
    threads: int,
    inputs: dict[str, Any],
    outputs: dict[str, str],
) -> None:
    """Measure one scene and write its tables: frames, local steps over r, cost of effects.

    Parameters
    ----------
    counts : numbers of iterations K of the full-order run that are timed beside the scene's own
    window : of the Anderson acceleration that each K is timed with, too
    protocol : settings of `pdrom.pipeline.study.Timing`
    inputs : mesh, fom (full-order run), and lists of bases, samplings, hyper
    outputs : frames, breakeven, effects, left_out
    """
    bound = scene_of(scene, inputs["mesh"], threads=threads)
    system = bound.system_with(solver)
    warmup, repeats = protocol["warmup"], protocol["repeats"]
    frames = min(protocol["frames"], bound.config.frames)
    make = partial(_variant, bound, system, frames)
    variants = _full_order(bound, make, protocol) + _other_counts(
        bound, system, frames, counts, window
    )
    alone: dict[tuple[str, str, int], ReducedLocalStep] = {}
    for path in inputs["samplings"]:
        group, method = Path(path).parent.name, Path(path).stem
        source = _Source(bound.group(group), method, methods[method], inputs["bases"], path)
        for r in source.sizes(ranks):
            step, labels = source.step(r), {"group": group, "method": method, "r": r}
            steps = replace_group(bound, group, LiftTimed(step))
            variants.append(make({**labels, "implementation": "compiled"}, steps))
        if source.spec.rows != "all":
            for r in source.sizes(protocol["breakeven"]):
                alone[group, method, r] = source.step(r)
    for labels, model in chain.from_iterable(load_models(path) for path in inputs["hyper"]):
        labels = {"group": "all", **labels, "implementation": "compiled"}
        variants.append(Variant(labels, *model.loop(bound), frames))
    slow = [v for v in variants if v.labels["implementation"] == "interpreted"]
    quick = [v for v in variants if v.labels["implementation"] != "interpreted"]
    name = bound.config.name
    told = partial(log.info, f"{name}: repeat %d of %d")
    results = measure(quick, warmup, repeats, told) + measure(slow, 0, repeats)
    write_table(pd.DataFrame([_row(bound, m) for m in results], columns=COLUMNS), outputs["frames"])
    log.info("%s: %d reduced local steps alone", name, len(alone))
    states = _states(inputs["fom"])
    times = local_costs(bound, alone, states, warmup, protocol["breakeven_repeats"])
    write_table(times.assign(factor=1.0), outputs["breakeven"])
    log.info("%s: effects", name)
    costs = effect_costs(bound, system, frames, warmup, repeats)
    write_table(costs, outputs["effects"])
    without = left_out(bound, costs, frames, warmup, repeats, solver)
    write_table(without, outputs["left_out"])


class _Source:
    """Reduced local steps of one group and method, by size."""

    def __init__(
        self, group: ConstraintGroup, method: str, spec: dict[str, Any], bases: list[str], path: str
    ) -> None:
        self.spec = MethodSpec.model_validate(spec)
        place = (group.name, self.spec.basis_id)
        file = next(b for b in bases if (Path(b).parent.name, Path(b).stem) == place)
        self._group, self._path, self._space = group, path, load_basis(file)
        with open_hdf5(path) as stored:
            self._stored = {int(key[1:]) for key in stored if key.startswith("r")}

    def sizes(self, asked: Sequence[int | str]) -> list[int]:
        """The asked sizes that the basis can have and the file holds."""
        return [r for r in resolve_ranks(asked, self._space.rank) if r in self._stored]

    def step(self, r: int) -> ReducedLocalStep:
        """Local step of size r."""
        reduction = load_reduction(self._space, self._path, self.spec, r)
        return ReducedLocalStep(self._group, reduction)


def _variant(
    scene: Scene,
    system: GlobalSystem,
    frames: int,
    labels: dict[str, Any],
    local_steps: Sequence[LocalStep],
) -> Variant:
    loop = scene.stepper(system, local_steps, track_objective=False)
    labels = {"iterations": scene.config.iterations, **labels}
    return Variant(labels, loop, scene.initial_state(), frames)


def _full_order(scene: Scene, make: Make, protocol: dict[str, Any]) -> list[Variant]:
    """The full-order run in every implementation; the slowest does only some iterations."""
    variants = [make({"implementation": "compiled"}, scene.groups)]
    for name, step in IMPLEMENTATIONS.items():
        variant = make({"implementation": name}, [step(g) for g in scene.groups])
        frames = min(variant.frames, protocol[f"{name}_frames"])
        variants.append(replace(variant, frames=frames))
    slow = variants[-1]
    whole = scene.config.iterations
    slow.loop.iterations = min(whole, protocol["interpreted_iterations"])
    variants[-1] = replace(slow, share=slow.loop.iterations / whole)
    return variants


def _other_counts(
    scene: Scene, system: GlobalSystem, frames: int, counts: list[int], window: int
) -> list[Variant]:
    """The compiled full-order run with other numbers of iterations, plain and accelerated."""
    variants = []
    own = (scene.config.iterations, scene.config.anderson_window)
    for count, size in accelerated(sorted({*counts, scene.config.iterations}), window):
        if (count, size) != own:
            loop = stepper_of(scene, system, count, size)
            method = ANDERSON if size else FOM
            labels = {"method": method, "iterations": count, "implementation": "compiled"}
            variants.append(Variant(labels, loop, scene.initial_state(), frames))
    return variants


def _states(fom: str) -> np.ndarray:
    """Positions (n, N, 3) spread over a full-order run."""
    with open_hdf5(fom) as file:
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
        "spread_ms": measurement.spread,
        "repeats": measurement.repeats,
    }
