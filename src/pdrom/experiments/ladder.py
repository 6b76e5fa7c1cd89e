"""Rule ladder: all rungs on one group of one scene."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import relative_errors
from pdrom.core.store import open_hdf5, read_table, write_table
from pdrom.experiments.ladder_spec import LadderSpec
from pdrom.experiments.scenes import scene_of
from pdrom.model.runs.horizon import error_within, floor_of, horizon
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.rerun import Rerun, displacement_norms, replace_group, rerun
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "direction", "rung", "r", "condition", "gain", "error_train", "error_test",
    "error_heldout", "finite", "blowup_frame", "relative_error_within_horizon",
]  # fmt: skip


def climb(
    labels: dict[str, str],
    scene: dict[str, Any],
    ladder: dict[str, Any],
    floor: dict[str, float],
    blowup_extent: float,
    mesh: str,
    fom: str,
    snapshots: str,
    sensitivity: str,
    output: str,
) -> None:
    """Reduce and rerun the scene with every rung and write the rows of the table ladder.

    Parameters
    ----------
    floor : perturbation and threshold that define the horizon
    """
    bound, data = scene_of(scene, mesh), load_snapshots(snapshots)
    with open_hdf5(fom) as file:
        reference = file["positions"][...]
    spread = floor_of(read_table(sensitivity), labels["scene"], floor["perturbation"])
    end = horizon(spread, floor["threshold"])
    displacement = displacement_norms(reference)
    system = bound.system
    group = bound.group(labels["group"])
    spec = LadderSpec.model_validate(ladder)
    rows = []
    for direction, method, seed in spec.rungs():
        row = {**labels, "direction": direction, "rung": _name(method, seed), "r": spec.r}
        reduction = _reduce(data, method, spec.r, seed)
        if reduction is not None:
            steps = replace_group(bound, group.name, ReducedLocalStep(group, reduction))
            outcome = rerun(bound, system, steps, reference, blowup_extent)
            row |= {"r": reduction.r, **_measures(reduction, data)}
            row |= _run(outcome, displacement, end)
        rows.append(row)
        log.info("%s, %s", direction, row["rung"])
    table = pd.DataFrame(rows, columns=COLUMNS)
    table["blowup_frame"] = table["blowup_frame"].astype("Int64")
    write_table(table, output)


def _name(method: MethodSpec, seed: int | None) -> str:
    return method.title if seed is None else f"signs {seed}"


def _reduce(data: SnapshotSet, method: MethodSpec, r: int, seed: int | None) -> Reduction | None:
    """Reduction of a rung; None where the group is round-off."""
    signs = None if seed is None else np.random.default_rng(seed)
    basis = compute_basis(
        data.train, data.row_mass, data.roundoff, data.rows_per_element, method, signs
    )
    size = min(r, basis.rank)
    return Reduction(basis, select(basis, method, size), method, size) if size else None


def _measures(reduction: Reduction, data: SnapshotSet) -> dict[str, Any]:
    errors = {}
    for split in SPLITS:
        p = getattr(data, split)
        errors[f"error_{split}"] = relative_errors(p, reduction.reconstruct(p), data.roundoff)[0]
    return {"condition": reduction.condition, "gain": reduction.gain, **errors}


def _run(outcome: Rerun, displacement: np.ndarray, end: int) -> dict[str, Any]:
    return {
        "finite": outcome.blowup_frame is None,
        "blowup_frame": outcome.blowup_frame,
        "relative_error_within_horizon": error_within(outcome.difference, displacement, end),
    }
