"""Rule iterations: what K costs in accuracy, against the limit K -> infinity."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import trajectory_error
from pdrom.core.store import open_hdf5, read_table, write_table
from pdrom.experiments.scenes import scene_of
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.stepper import Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.runs.converged import ConvergedStepper
from pdrom.model.runs.horizon import floor_of, horizon
from pdrom.model.scene import Scene
from pdrom.reduction.local.rerun import displacement_norms

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "iterations", "window", "frames", "error_converged", "error_scene", "residual",
]  # fmt: skip


def sweep_iterations(
    config: dict[str, Any],
    settings: dict[str, Any],
    floor: dict[str, float],
    solver: str,
    mesh: str,
    fom: str,
    sensitivity_table: str,
    output: str,
) -> None:
    """Run a scene with every K of ``settings`` up to its horizon, and once to convergence.

    Each K runs plainly (``window`` 0) and with Anderson acceleration. Each row has the error of a
    K against the converged run and against the scene's own run; the last row is the converged run
    itself (``iterations`` empty) with its largest residual: the change by one more iteration,
    relative to the extent. If a frame stays above the tolerance there is no converged reference,
    and the errors against it are empty.

    Parameters
    ----------
    settings : counts, anderson_window, tolerance, limit (see `pdrom.pipeline.study.IterationSweep`)
    floor : perturbation and threshold that define the horizon
    """
    scene = scene_of(config, mesh)
    system = scene.system_with(solver)
    name = scene.config.name
    spread = floor_of(read_table(sensitivity_table), name, floor["perturbation"])
    frames = max(1, horizon(spread, floor["threshold"]))
    with open_hdf5(fom) as file:
        own = file["positions"][: frames + 1]
    best = ConvergedStepper(scene, system, settings["tolerance"], settings["limit"])
    limit = _run(best, scene, frames)
    if not best.converged:
        log.warning("%s: no convergence in %d evaluations", name, settings["limit"])
    log.info("%s: %.0f evaluations a frame", name, np.mean(best.evaluations))
    rows = []
    counts = sorted({*settings["counts"], scene.config.iterations})
    for count, window in accelerated(counts, settings["anderson_window"]):
        run = own
        if (count, window) != (scene.config.iterations, scene.config.anderson_window):
            run = _run(stepper_of(scene, system, count, window), scene, frames)
        converged = _error(run, limit) if best.converged else None
        rows.append((name, count, window, frames, converged, _error(run, own), None))
    residual = max(best.changes) / scene.mesh.extent
    converged = 0.0 if best.converged else None
    rows.append((name, None, None, frames, converged, _error(limit, own), residual))
    table = pd.DataFrame(rows, columns=COLUMNS).astype({"iterations": "Int64", "window": "Int64"})
    write_table(table, output)


def accelerated(counts: list[int], window: int) -> list[tuple[int, int]]:
    """(K, window) of all runs: plain ones, then accelerated ones where K lets two iterates mix."""
    plain = [(count, 0) for count in counts]
    return plain + [(count, window) for count in counts if window and count > 2]


def stepper_of(scene: Scene, system: GlobalSystem, iterations: int, window: int) -> Stepper:
    """Step loop of the full-order model with its own number of iterations and acceleration."""
    acceleration = Anderson(window) if window else None
    space = scene.space(system)
    return Stepper(space, scene.config.time_step, iterations, scene.groups, False, acceleration)


def _run(loop: Stepper, scene: Scene, frames: int) -> np.ndarray:
    """Positions (frames + 1, N, 3), the initial ones first."""
    state = scene.initial_state()
    positions = [state.positions]
    for frame in range(frames):
        state, _ = loop.step(state, frame)
        positions.append(state.positions)
    return np.stack(positions)


def _error(run: np.ndarray, reference: np.ndarray) -> float | None:
    difference = np.linalg.norm((run - reference)[1:].reshape(len(run) - 1, -1), axis=1)
    return trajectory_error(difference, displacement_norms(reference))
