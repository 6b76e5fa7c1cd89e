"""Rule timing: milliseconds per frame of the full-order run and of every reduced local step."""

import logging
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.basis import load_basis
from pdrom.constraints.implementations import IMPLEMENTATIONS
from pdrom.method import MethodSpec
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.ranks import resolve_ranks
from pdrom.rom.rerun import replace_group
from pdrom.sampling.load import load_reduction
from pdrom.scene import Scene
from pdrom.stages.scenes import scene_of
from pdrom.store import write_table
from pdrom.timing import Measurement, Variant, measure

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "vertices", "implementation",
    "ms_per_frame", "local_ms", "assembly_ms", "global_ms", "spread_ms", "repeats",
]  # fmt: skip


def time_scene(
    scene: dict[str, Any],
    methods: dict[str, dict[str, Any]],
    ranks: list[int | str],
    protocol: dict[str, int],
    solver: str,
    mesh: str,
    bases: list[str],
    samplings: list[str],
    output: str,
) -> None:
    """Measure one scene and write its timing table."""
    bound = scene_of(scene, mesh)
    system = bound.system_with(solver)
    variants = _full_order(bound, protocol)
    for path in samplings:
        group, method = Path(path).parent.name, Path(path).stem
        spec = MethodSpec.model_validate(methods[method])
        basis = next(b for b in bases if Path(b).parent.name == group and Path(b).stem == spec.basis_id)
        variants += _reduced(bound, group, method, spec, ranks, basis, path, protocol)
    slow = [v for v in variants if v.labels["implementation"] == "interpreted"]
    quick = [v for v in variants if v.labels["implementation"] != "interpreted"]
    results = measure(
        bound,
        system,
        quick,
        protocol["warmup"],
        protocol["repeats"],
        lambda done, total: log.info("%s: repeat %d of %d", bound.config.name, done, total),
    )
    results += measure(bound, system, slow, 0, protocol["repeats"])
    write_table(pd.DataFrame([_row(bound, m) for m in results], columns=COLUMNS), output)


def _full_order(scene: Scene, protocol: dict[str, int]) -> list[Variant]:
    variants = [Variant({"implementation": "compiled"}, scene.groups, protocol["frames"])]
    for name, step in IMPLEMENTATIONS.items():
        frames = protocol["interpreted_frames" if name == "interpreted" else "frames"]
        variants.append(Variant({"implementation": name}, [step(g) for g in scene.groups], frames))
    return variants


def _reduced(
    scene: Scene,
    group: str,
    method: str,
    spec: MethodSpec,
    ranks: list[int | str],
    basis: str,
    sampling: str,
    protocol: dict[str, int],
) -> list[Variant]:
    space = load_basis(basis)
    variants = []
    for r in resolve_ranks(ranks, space.rank):
        if r > space.rank:
            continue
        reduction = load_reduction(space, sampling, spec, r)
        local = ReducedLocalStep(scene.group(group), reduction)
        labels = {"group": group, "method": method, "r": r, "implementation": "compiled"}
        variants.append(Variant(labels, replace_group(scene, group, local), protocol["frames"]))
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
