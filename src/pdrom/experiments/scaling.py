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

from pdrom.core.store import write_table
from pdrom.experiments.local_costs import local_costs
from pdrom.experiments.measurement import Measurement, Variant, measure
from pdrom.experiments.names import FOM
from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.basis import Basis, compute_basis
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import replace_group
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select, select_path
from pdrom.reduction.snapshots import row_masses
from pdrom.reduction.subspace.model import SubspaceModel, make_columns, sample_elements

log = logging.getLogger(__name__)

ITERATIONS = [
    "scene", "method", "threads", "vertices", "elements", "r", "k", "elements_sampled",
    "factorisation_ms", "memory_mb", "ms_per_iteration", "local_ms", "global_ms", "local_share",
]  # fmt: skip
STATES = 4  # states of the training run at which local steps are timed alone


@dataclass(frozen=True)
class Training:
    """Positions (n, N, 3) m after the training frames, and projections (n, e p, 3) within them.

    ``roundoff`` (n,) is that of the projections.
    """

    positions: np.ndarray
    projections: np.ndarray
    roundoff: np.ndarray

    def first(self, frames: int) -> "Training":
        """The same of the first frames only."""
        return Training(self.positions[:frames], self.projections[:frames], self.roundoff[:frames])


def scale_scene(
    scene: dict[str, Any],
    factor: float,
    methods: dict[str, dict[str, Any]],
    settings: dict[str, Any],
    solver: str,
    root: str,
    outputs: dict[str, str],
) -> None:
    """Measure a scene on one mesh size and write its parts of the tables scaling and breakeven.

    Parameters
    ----------
    factor : on the vertices along each side of the mesh
    methods : specifications of the reductions of the local step that ``settings`` name
    settings : of `pdrom.pipeline.study.Scaling`, without the scenes
    outputs : iterations, breakeven
    """
    config = SceneConfig.model_validate(scene)
    # libraries and kernels are loaded before anything is measured
    _factorised(Scene.build(config, config.mesh.build(Path(root))), solver)
    config = config.coarsened(factor, 1.0)
    bound = Scene.build(config, config.mesh.build(Path(root)))
    idle = _memory()
    system, seconds = _factorised(bound, solver)
    measured = {"factorisation_ms": 1e3 * seconds, "memory_mb": _memory() - idle}
    alone = settings["breakeven"]
    training = _train(bound, system, max(settings["training_frames"], alone["training_frames"]))
    first = training.first(settings["training_frames"])
    specs = {name: MethodSpec.model_validate(spec) for name, spec in methods.items()}
    method = settings["method"]
    basis = _basis(bound, first, specs[method])
    two = Scene.build(config, bound.mesh, threads=2)
    variants = [
        _full_order(bound, system, settings, measured),
        _full_order(two, system, settings, {"threads": 2}),
        _reduced(bound, system, basis, specs[method], settings),
        _hyper(bound, first, settings),
    ]
    results = measure(variants, settings["warmup"], settings["repeats"])
    rows = [{"scene": config.name, "threads": 1, **m.labels, **_times(bound, m)} for m in results]
    table = pd.DataFrame(rows, columns=ITERATIONS)
    write_table(table, outputs["iterations"])
    steps = _steps_alone(bound, training.first(alone["training_frames"]), specs, alone)
    states = training.positions[:: len(training.positions) // STATES][:STATES]
    times = local_costs(bound, steps, states, settings["warmup"], alone["repeats"])
    write_table(times.assign(factor=factor), outputs["breakeven"])
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
    return Training(np.stack(positions), np.stack(projections), np.array(roundoff))


def _basis(scene: Scene, training: Training, spec: MethodSpec) -> Basis:
    group = scene.groups[0]
    mass, rows = row_masses(group, scene.masses), group.rows_per_element
    roundoff = float(np.linalg.norm(training.roundoff))
    return compute_basis(training.projections, mass, roundoff, rows, spec)


def _steps_alone(
    scene: Scene, training: Training, specs: dict[str, MethodSpec], settings: dict[str, Any]
) -> dict[tuple[str, str, int], ReducedLocalStep]:
    """Local steps of the first group by group, method and size, as far as the rank allows."""
    group, steps = scene.groups[0], {}
    for name in settings["methods"]:
        spec, basis = specs[name], _basis(scene, training, specs[name])
        sizes = sorted({min(r, basis.rank) for r in settings["sizes"]})
        for size, sampling in select_path(basis, spec, sizes).items():
            reduction = Reduction(basis, sampling, spec, size)
            steps[group.name, name, size] = ReducedLocalStep(group, reduction)
    return steps


def _full_order(
    scene: Scene, system: GlobalSystem, settings: dict[str, Any], labels: dict[str, Any]
) -> Variant:
    return _variant(scene, system, scene.groups, settings, {"method": FOM, **labels})


def _reduced(
    scene: Scene, system: GlobalSystem, basis: Basis, spec: MethodSpec, settings: dict[str, Any]
) -> Variant:
    group, method = scene.groups[0], settings["method"]
    size = min(settings["r"], basis.rank)
    reduction = Reduction(basis, select(basis, spec, size), spec, size)
    steps = replace_group(scene, group.name, ReducedLocalStep(group, reduction))
    labels = {"r": reduction.r, "elements_sampled": len(reduction.elements)}
    return _variant(scene, system, steps, settings, {"method": method, **labels})


def _hyper(scene: Scene, training: Training, settings: dict[str, Any]) -> Variant:
    columns = make_columns(scene, training.positions, "pod", settings["k"])
    frames = np.arange(len(training.positions))
    (samples,) = sample_elements(scene, columns, frames, [settings["tolerance"]])
    model = SubspaceModel("pod", columns, samples)
    labels = {
        "method": "ecsw",
        "k": columns.modes,
        "elements_sampled": sum(len(chosen.elements) for chosen in samples.values()),
    }
    return Variant(labels, *model.loop(scene), settings["frames"])


def _variant(
    scene: Scene,
    system: GlobalSystem,
    steps: list[LocalStep],
    settings: dict[str, Any],
    labels: dict[str, Any],
) -> Variant:
    loop = scene.stepper(system, steps, track_objective=False)
    return Variant(labels, loop, scene.initial_state(), settings["frames"])


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
