"""Rule timing: milliseconds per frame of the full-order run and of every reduced local step."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.basis import load_basis
from pdrom.constraints.implementations import IMPLEMENTATIONS
from pdrom.fom.stepper import LocalStep
from pdrom.fom.system import GlobalSystem
from pdrom.method import MethodSpec
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.ranks import resolve_ranks
from pdrom.rom.rerun import replace_group
from pdrom.sampling.load import load_reduction
from pdrom.scene import Scene
from pdrom.stages.scenes import scene_of
from pdrom.store import write_table
from pdrom.subspace.load import load_models
from pdrom.timing import Measurement, Variant, measure

log = logging.getLogger(__name__)

Make = Callable[[dict[str, Any], Sequence[LocalStep]], Variant]

COLUMNS = [
    "scene", "group", "method", "position_basis", "k", "r", "vertices", "implementation",
    "ms_per_frame", "local_ms", "assembly_ms", "global_ms", "spread_ms", "repeats",
]  # fmt: skip


def time_scene(
    scene: dict[str, Any],
    methods: dict[str, dict[str, Any]],
    ranks: list[int | str],
    protocol: dict[str, int],
    solver: str,
    threads: int,
    mesh: str,
    bases: list[str],
    samplings: list[str],
    hyper: list[str],
    output: str,
) -> None:
    """Measure one scene and write its timing table."""
    bound = scene_of(scene, mesh, threads=threads)
    system = bound.system_with(solver)
    frames = min(protocol["frames"], bound.config.frames)
    make = partial(_variant, bound, system, frames)
    variants = _full_order(bound, make, protocol)
    for path in samplings:
        group, method = Path(path).parent.name, Path(path).stem
        spec = MethodSpec.model_validate(methods[method])
        place = (group, spec.basis_id)
        basis = next(b for b in bases if (Path(b).parent.name, Path(b).stem) == place)
        variants += _reduced(bound, group, method, spec, ranks, basis, path, make)
    for labels, model in chain.from_iterable(load_models(path) for path in hyper):
        labels = {"group": "all", **labels, "implementation": "compiled"}
        variants.append(Variant(labels, *model.loop(bound), frames))
    slow = [v for v in variants if v.labels["implementation"] == "interpreted"]
    quick = [v for v in variants if v.labels["implementation"] != "interpreted"]
    results = measure(
        quick,
        protocol["warmup"],
        protocol["repeats"],
        lambda done, total: log.info("%s: repeat %d of %d", bound.config.name, done, total),
    )
    results += measure(slow, 0, protocol["repeats"])
    write_table(pd.DataFrame([_row(bound, m) for m in results], columns=COLUMNS), output)


def _variant(
    scene: Scene,
    system: GlobalSystem,
    frames: int,
    labels: dict[str, Any],
    local_steps: Sequence[LocalStep],
) -> Variant:
    loop = scene.stepper(system, local_steps, track_objective=False)
    return Variant(labels, loop, scene.initial_state(), frames)


def _full_order(scene: Scene, make: Make, protocol: dict[str, int]) -> list[Variant]:
    variants = [make({"implementation": "compiled"}, scene.groups)]
    for name, step in IMPLEMENTATIONS.items():
        variant = make({"implementation": name}, [step(g) for g in scene.groups])
        frames = min(variant.frames, protocol[f"{name}_frames"])
        variants.append(replace(variant, frames=frames))
    return variants


def _reduced(
    scene: Scene,
    group: str,
    method: str,
    spec: MethodSpec,
    ranks: list[int | str],
    basis: str,
    sampling: str,
    make: Make,
) -> list[Variant]:
    space = load_basis(basis)
    variants = []
    for r in resolve_ranks(ranks, space.rank):
        if r > space.rank:
            continue
        reduction = load_reduction(space, sampling, spec, r)
        local = ReducedLocalStep(scene.group(group), reduction)
        labels = {"group": group, "method": method, "r": r, "implementation": "compiled"}
        variants.append(make(labels, replace_group(scene, group, local)))
    return variants


def _row(scene: Scene, measurement: Measurement) -> dict[str, Any]:
    return {
        "scene": scene.config.name,
        "vertices": scene.mesh.vertices,
        **measurement.labels,
        "ms_per_frame": measurement.frame,
        "local_ms": measurement.local,
        "assembly_ms": measurement.assembly,
        "global_ms": measurement.solve,
        "spread_ms": measurement.spread,
        "repeats": measurement.repeats,
    }
