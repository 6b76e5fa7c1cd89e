"""Compute converged full-order runs of a scene, the default reference of errors.

A frame of a converged run ends when one more local/global iteration would move no vertex by more
than a tolerance. A second run with a smaller tolerance estimates the error of the converged run.
"""

import logging
from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import open_hdf5, write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.metrics import affine_residuals, trajectory_error
from pdrom.model.runs import ConvergedStepper
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.rerun import displacement_norms
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting
from study.experiments.kit import base as kit

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "motion", "frames", "horizon_frame", "evaluations", "reference_error",
    "reference_deformation_error", "full_order_error", "full_order_deformation_error",
    "replay_error", "replay_deformation_error", "deformation", "affine", "playback_all",
    "playback_error", "playback_deformation_error",
]  # fmt: skip
FINER = 1e-2  # tolerance of the second run, relative to that of the first run
AFTER = 1e-4  # tolerance of frames after the horizon, in which no error is measured


class Reference(ConfigModel):
    """Section ``reference``: conditions that end a frame of the converged runs.

    tolerance : largest move of a vertex by one more iteration, relative to the longest side
    limit : largest number of evaluations of a frame's objective
    """

    tolerance: kit.Tolerance = 1e-7
    limit: Annotated[int, Field(ge=2)] = 20_000


@kit.experiment(
    "Converged runs of {scene}",
    reads={
        "mesh": paths.MESH,
        "sensitivity": paths.SENSITIVITY,
        "full_order": Every(paths.FULL_ORDER),
        "config": Setting("scene"),
        "asked": Setting("reference"),
        "horizon": Setting("horizon"),
    },
    writes={
        "train": paths.CONVERGED.where(run="train"),
        "heldout": paths.CONVERGED.where(run="heldout"),
        "kick": paths.CONVERGED.where(run="kick"),
        "stiffness": paths.CONVERGED.where(run="stiffness"),
        "out": paths.REFERENCES,
    },
)
def references(
    mesh: File, sensitivity: File, full_order: list[File], config: SceneConfig,
    asked: Reference, horizon: kit.Horizon, out: File, **runs: File,
) -> None:  # fmt: skip
    """Write converged runs of all trajectories of a scene to ``runs``, and errors to ``out``.

    The error of a converged run is its difference, before the horizon, from a second run with the
    tolerance times `FINER`. On sheets, which may have several minima, the second run starts every
    frame from another guess. If a frame does not converge, the file has no positions.
    """
    rows: list[dict[str, object]] = []
    training: tuple[np.ndarray, np.ndarray | None] | None = None
    for run in full_order:
        motion = run["run"]
        scene = kit.scene_of(config, mesh, motion)
        end, frames = horizon.frames(sensitivity, motion), scene.config.frames
        first, evaluations = _run(scene, asked, end, frames)
        own = kit.positions_of(run)
        training = training or (own, first)
        row = {"scene": config.name, "motion": motion, "frames": frames, "horizon_frame": end}
        row |= {"evaluations": evaluations, "playback_all": run_error(training[0], own)}
        row |= _errors("playback", Yardstick(scene, own), training[0], end)
        with write_hdf5(runs[motion].path) as store:
            if first is None:
                log.warning("%s: no convergence in %d evaluations", motion, asked.limit)
            else:
                store["positions"] = first
                yardstick = Yardstick(scene, first)
                row |= _errors("full_order", yardstick, own, end)
                row |= _errors("replay", yardstick, training[1], end) | _deformation(yardstick)
                second, _ = _run(scene, asked, end, end, again=True)
                if second is not None:
                    row |= _errors("reference", Yardstick(scene, second), first, end)
        rows.append(row)
        log.info("%s: %.0f evaluations a frame", motion, evaluations)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _errors(
    name: str, yardstick: Yardstick, run: np.ndarray | None, end: int
) -> dict[str, float | None]:
    """Return the position and deformation error of ``run`` before frame ``end``, by column."""
    found = (None, None) if run is None else yardstick.errors(run, end)
    return dict(zip((f"{name}_error", f"{name}_deformation_error"), found, strict=True))


def _deformation(converged: Yardstick) -> dict[str, float | None]:
    """Return distances of the run from the best rigid and affine maps of the rest shape, by column.

    They are norms over all frames, relative to that of the displacement; None if nothing moves.
    """
    scene, run = converged.scene, converged.reference
    root = np.sqrt(scene.masses / scene.masses.mean())[:, None]
    moved = float(np.linalg.norm(root * (run[1:] - run[0])))
    affine = affine_residuals(scene.mesh.points, run[1:], scene.masses)
    residuals = {"deformation": converged.deformed, "affine": affine}
    return {
        k: float(np.linalg.norm(own)) / moved if moved else None for k, own in residuals.items()
    }


def _run(
    scene: Scene, asked: Reference, end: int, frames: int, again: bool = False
) -> tuple[np.ndarray | None, float]:
    """Return positions (None if a frame does not converge) and mean evaluations of a frame."""
    tolerance, sheet = asked.tolerance * (FINER if again else 1.0), not len(scene.mesh.tetrahedra)
    loop = ConvergedStepper(scene, scene.system, tolerance, asked.limit, from_last=again and sheet)
    state = scene.initial_state()
    positions = [state.positions]
    for frame in range(frames):
        if frame == end:
            loop.tolerance = max(tolerance, AFTER) * scene.mesh.extent
        state, _ = loop.step(state, frame)
        positions.append(state.positions)
    evaluations = float(np.mean(loop.evaluations)) if frames else 0.0
    return np.stack(positions) if loop.converged else None, evaluations


def converged_positions(run: File, frames: int | None = None) -> np.ndarray | None:
    """Read positions (F + 1, N, 3) m of a converged run, or of its first frames; None if absent."""
    with open_hdf5(run.path) as file:
        stored = file.get("positions")
        return None if stored is None else stored[: None if frames is None else frames + 1]


def run_error(run: np.ndarray, reference: np.ndarray) -> float | None:
    """Return the relative error of ``run`` (F + 1, N, 3) m; None if ``reference`` never moves."""
    difference = np.linalg.norm((run - reference)[1:].reshape(len(run) - 1, -1), axis=1)
    return trajectory_error(difference, displacement_norms(reference))
