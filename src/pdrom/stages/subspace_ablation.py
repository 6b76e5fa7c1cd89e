"""Rule subspace_ablation: variants of block DEIM in a position subspace, on one scene."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.errors import SamplingError
from pdrom.fom.sensitivity import horizon
from pdrom.metrics import trajectory_error
from pdrom.stages.hyper import Motion, training_positions
from pdrom.stages.scenes import scene_of
from pdrom.store import write_table
from pdrom.subspace.columns import Columns
from pdrom.subspace.interpolation import Interpolation
from pdrom.subspace.model import SubspaceModel, make_columns
from pdrom.subspace.specs import InterpolationSpec
from pdrom.subspace.training import Training, interpolate
from pdrom.subspace_ablation import AblationSpec
from pdrom.tables.columns import COLUMNS
from pdrom.tables.sensitivity import floor_of
from pdrom.tables.sensitivity import sensitivity as largest_over_seeds

log = logging.getLogger(__name__)

POSITION_BASIS = "pod"


def ablate(
    scene: dict[str, Any],
    ablation: dict[str, Any],
    floor: dict[str, float],
    blowup_extent: float,
    mesh: str,
    fom: str,
    sensitivity: str,
    output: str,
) -> None:
    """Run every variant with all groups interpolated and write the rows of subspace_ablation.

    Parameters
    ----------
    floor : perturbation and threshold that define the horizon
    """
    spec = AblationSpec.model_validate(ablation)
    motion = Motion(scene_of(scene, mesh), fom)
    name = motion.scene.config.name
    spread = floor_of(largest_over_seeds([sensitivity]), name, floor["perturbation"])
    end = horizon(spread, floor["threshold"])
    training = training_positions(motion.scene, motion.reference)
    rows = []
    for k in spec.sizes:
        columns = make_columns(motion.scene, training, POSITION_BASIS, k)
        trained = Training(motion.scene, columns, training)
        whole = motion.run(SubspaceModel(POSITION_BASIS, columns), blowup_extent)
        row = {
            "scene": name,
            "group": ", ".join(group.name for group in motion.scene.groups),
            "position_basis": POSITION_BASIS,
            "k": k,
            "relative_error_full_projections": _error(motion, whole, end),
        }
        for variant, settings in spec.cases():
            row = row | {"r": settings.modes, "variant": variant}
            found = _interpolations(motion, columns, trained, settings)
            rows.append(row | _outcome(motion, columns, found, end, blowup_extent))
            log.info("k = %d, r = %d, %s: %s", k, settings.modes, variant, rows[-1])
    table = pd.DataFrame(rows, columns=COLUMNS["subspace_ablation"])
    table["finite"] = table["finite"].astype("boolean")
    table["elements_sampled"] = table["elements_sampled"].astype("Int64")
    write_table(table, output)


def _interpolations(
    motion: Motion, columns: Columns, trained: Training, settings: InterpolationSpec
) -> dict[str, Interpolation] | None:
    """Interpolation of every group; None if a basis is refused."""
    try:
        return interpolate(motion.scene, columns, trained, settings)
    except SamplingError as error:
        log.info("refused: %s", error)
        return None


def _outcome(
    motion: Motion,
    columns: Columns,
    found: dict[str, Interpolation] | None,
    end: int,
    blowup_extent: float,
) -> dict[str, Any]:
    """What a variant did; a refused one has not run, and its cells are empty."""
    if found is None:
        return {}
    run = motion.run(SubspaceModel(POSITION_BASIS, columns, found), blowup_extent)
    return {
        "elements_sampled": sum(len(chosen.elements) for chosen in found.values()),
        "gain": max(chosen.gain for chosen in found.values()),
        "finite": run["blowup_frame"] is None,
        "max_extent": float(run["extent"].max(initial=0.0)),
        "relative_error_within_horizon": _error(motion, run, end),
    }


def _error(motion: Motion, run: dict[str, Any], end: int) -> float | None:
    """Relative error over the frames before ``end``; None if the run did not get there."""
    difference: np.ndarray = run["difference"]
    if len(difference) < end:
        return None
    return trajectory_error(difference[:end], motion.displacement[:end])
