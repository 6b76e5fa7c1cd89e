"""Runs of held-out motions within requested tolerances, by solvers calibrated on other motions."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.model.held_out import MOTIONS, HeldOutMotion
from pdrom.model.runs import converged_run, trajectory
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.requested import levels, run
from pdrom.reduction.requested.levels import Level, Motion, Quantity, Trajectory
from study.artifact.paths import REQUESTED_TOLERANCES, File
from study.artifact.reads import Setting, SourcesOf
from study.experiments.kit.base import Tolerance, experiment

log = logging.getLogger(__name__)

# Arguments of `converged_run` for the run against which errors are computed: tolerance, relative to
# the mesh's longest side, and largest number of evaluations of a frame's objective.
CONVERGED = 1e-9, 8000
COLUMNS = [
    "scene", "motion", "tolerance", "vertices", "frames", "reduced", "error", "velocity_error",
    "expected", "estimate", "level", "failed", "checks", "ms_per_frame", "full_level",
    "full_ms", "own_ms", "playback_error", "reference_error",
]  # fmt: skip


class RequestedRuns(run.ToleranceSettings):
    """Settings: each of ``motions`` is run with each requested tolerance in ``errors``."""

    errors: Annotated[tuple[Tolerance, ...], Field(min_length=1)] = (0.1, 0.03, 0.01)
    motions: Annotated[tuple[HeldOutMotion, ...], Field(min_length=1)] = MOTIONS


class RequestedTolerances(RequestedRuns):
    """Section ``requested_tolerances``; empty ``scenes``: those of the study and of ``online``."""

    scenes: tuple[str, ...] = ()


@experiment(
    "Requested tolerances of {scene}",
    reads={
        "sources": SourcesOf("scene.mesh"),
        "config": Setting("scene"),
        "section": Setting("requested_tolerances"),
    },
    writes={"out": REQUESTED_TOLERANCES},
)
def requested_tolerances(
    sources: list[Path], config: SceneConfig, section: RequestedRuns, out: File
) -> None:
    """Calibrate full-order and reduced solvers; run held-out motions within requested tolerances.

    sources : files of the mesh; the job depends on them
    section : tolerances, motions, and settings of the solvers to choose from
    out : table of the runs
    """
    training = Scene.build(config, config.mesh.build(Path()))
    made: list[run.Calibration] = []
    rows: list[dict[str, Any]] = []
    recorded = trajectory(training, track_objective=False)
    for name in section.motions:
        variant = Scene.build(config.heldout_variant(name), training.mesh, masses=training.masses)
        own = run.transferred(training, variant)
        if not made or made[-1].motions[0].scene.config.effects != own.config.effects:
            made.append(run.calibrate(own, section))
        found = _rows(variant, recorded, made[-1], section)
        rows += ({"motion": name, **row} for row in found)
        log.info("%s: %s done", config.name, name)
    write_table(pd.DataFrame(rows, columns=COLUMNS), out.path)


def _rows(
    scene: Scene, recorded: np.ndarray, own: run.Calibration, section: RequestedRuns
) -> Iterator[dict[str, Any]]:
    """Yield a table row for each requested tolerance, for ``scene`` with a held-out motion.

    Errors are against a run solved to convergence, more accurately than in a calibration; if it is
    not, against a reference run as in a calibration. ``recorded`` (F + 1, N, 3) m is the run of the
    training motion.
    """
    frames = scene.config.frames
    motion = Motion(scene, "position")
    true = converged_run(scene, *CONVERGED)
    if true is None:
        log.warning("%s: a held-out motion does not converge", scene.config.name)
        true = motion.reference
    own_run = Trajectory(Level(scene.config.iterations), scene).to(frames)
    known: dict[str, Trajectory] = {}
    for error in section.errors:
        done, full = run.CheckedRun(own, scene, error).outcome(), own.full_order(error).level
        if full.title not in known:
            known[full.title] = Trajectory(full, scene).to(frames)
        end = done.frames or levels.last_within(motion.unknown, error)
        yield {
            "scene": scene.config.name,
            "tolerance": error,
            "vertices": scene.mesh.vertices,
            "frames": done.frames,
            "reduced": done.reduced,
            "error": _error(true, done.positions, end, "position"),
            "velocity_error": _error(true, done.positions, end, "velocity"),
            "expected": done.expected,
            "estimate": done.estimate,
            "level": done.level,
            "failed": len(done.failed),
            "checks": len(done.checks),
            "ms_per_frame": 1e3 * done.seconds / frames,
            "full_level": full.title,
            "full_ms": 1e3 * known[full.title].seconds / frames,
            "own_ms": 1e3 * own_run.seconds / frames,
            "playback_error": _error(true, recorded, end, "position"),
            "reference_error": _error(true, motion.reference, end, "position"),
        }


def _error(true: np.ndarray, reached: np.ndarray, end: int, quantity: Quantity) -> float | None:
    """Error of ``reached`` against ``true`` (F + 1, N, 3) m to frame ``end``; None if end = 0."""
    if not end:
        return None
    return float(levels.relative_errors(reached[1:] - true[1:], true, quantity)[end - 1])
