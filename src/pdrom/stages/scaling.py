"""Rule scaling: full-order and reduced iterations of one scene on growing meshes."""

import ctypes
import gc
import logging
import os
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd
import psutil

from pdrom.basis import compute_basis
from pdrom.fom.stepper import LocalStep
from pdrom.fom.system import GlobalSystem
from pdrom.method import MethodSpec
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.rerun import replace_group
from pdrom.sampling import Reduction, select
from pdrom.scene import Scene, SceneConfig
from pdrom.snapshots import row_masses
from pdrom.store import write_table
from pdrom.subspace.model import SubspaceModel, make_columns, sample_elements
from pdrom.tables.columns import COLUMNS
from pdrom.timing import Measurement, Variant, measure

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Training:
    """Positions (n, N, 3) m after the training frames, and projections (n, e p, 3) within them."""

    positions: np.ndarray
    projections: np.ndarray
    roundoff: float


def scale_scene(
    scene: dict[str, Any],
    factor: float,
    method: str,
    spec: dict[str, Any],
    settings: dict[str, Any],
    solver: str,
    root: str,
    output: str,
) -> None:
    """Measure a scene on one mesh size and write its part of the table scaling.

    Parameters
    ----------
    factor : on the vertices along each side of the mesh
    method, spec : reduction of the local step that is timed beside the full-order run
    settings : frames of training and of timing, warm-up and repeats, r, k, tolerance
    """
    config = SceneConfig.model_validate(scene)
    # libraries and kernels are loaded before anything is measured
    _factorised(Scene.build(config, config.mesh.build(Path(root))), solver)
    config = config.coarsened(factor, 1.0)
    bound = Scene.build(config, config.mesh.build(Path(root)))
    idle = _memory()
    system, seconds = _factorised(bound, solver)
    measured = {"factorisation_ms": 1e3 * seconds, "memory_mb": _memory() - idle}
    training = _train(bound, system, settings["training_frames"])
    variants = {"fom": (_variant(bound, system, bound.groups, settings), measured)}
    variants[method] = _reduced(bound, system, training, MethodSpec.model_validate(spec), settings)
    variants["ecsw"] = _hyper(bound, training, settings)
    results = measure([v for v, _ in variants.values()], settings["warmup"], settings["repeats"])
    rows = [
        {"scene": config.name, "method": name, **labels, **_times(bound, result)}
        for (name, (_, labels)), result in zip(variants.items(), results, strict=True)
    ]
    write_table(pd.DataFrame(rows, columns=list(COLUMNS["scaling"])), output)
    log.info("%s: %d vertices done", config.name, bound.mesh.vertices)


def _factorised(scene: Scene, solver: str) -> tuple[GlobalSystem, float]:
    """Global system, and the seconds that its assembly and first factorisation take."""
    state = scene.initial_state()
    started = perf_counter()
    system = scene.system_with(solver)
    fixed, _ = scene.space(system).fixed(0, state.positions)
    system.eliminate(fixed)
    return system, perf_counter() - started


def _train(scene: Scene, system: GlobalSystem, frames: int) -> Training:
    """The first frames of the full-order run; projections at the last local iterates."""
    group = scene.groups[0]
    loop, state = scene.stepper(system, track_objective=False), scene.initial_state()
    positions, projections, roundoff = [], [], []

    def watch(y: np.ndarray) -> None:
        projections.append(group.project(y))
        roundoff.append(group.roundoff(y))

    for frame in range(frames):
        state, _ = loop.step(state, frame, watch)
        positions.append(state.positions)
    return Training(np.stack(positions), np.stack(projections), float(np.linalg.norm(roundoff)))


def _reduced(
    scene: Scene,
    system: GlobalSystem,
    training: Training,
    spec: MethodSpec,
    settings: dict[str, Any],
) -> tuple[Variant, dict[str, Any]]:
    group = scene.groups[0]
    mass, rows = row_masses(group, scene.masses), group.rows_per_element
    basis = compute_basis(training.projections, mass, training.roundoff, rows, spec)
    size = min(settings["r"], basis.rank)
    reduction = Reduction(basis, select(basis, spec, size), spec, size)
    steps = replace_group(scene, group.name, ReducedLocalStep(group, reduction))
    labels = {"r": size, "elements_sampled": len(reduction.elements)}
    return _variant(scene, system, steps, settings), labels


def _hyper(
    scene: Scene, training: Training, settings: dict[str, Any]
) -> tuple[Variant, dict[str, Any]]:
    columns = make_columns(scene, training.positions, "pod", settings["k"])
    frames = np.arange(len(training.positions))
    (samples,) = sample_elements(scene, columns, frames, [settings["tolerance"]])
    model = SubspaceModel("pod", columns, samples)
    labels = {
        "k": columns.modes,
        "elements_sampled": sum(len(chosen.elements) for chosen in samples.values()),
    }
    return Variant({}, *model.loop(scene), settings["frames"]), labels


def _variant(
    scene: Scene, system: GlobalSystem, steps: list[LocalStep], settings: dict[str, Any]
) -> Variant:
    loop = scene.stepper(system, steps, track_objective=False)
    return Variant({}, loop, scene.initial_state(), settings["frames"])


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
    library = ctypes.CDLL(None) if os.name == "posix" else None
    if hasattr(library, "malloc_trim"):  # glibc; elsewhere small sizes may fit into free memory
        library.malloc_trim(0)
    return psutil.Process().memory_info().rss / 1e6
