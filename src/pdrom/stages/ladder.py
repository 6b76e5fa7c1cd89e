"""Rule ladder: all rungs on one group of one scene."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.basis import compute_basis
from pdrom.ladder import LadderSpec
from pdrom.method import MethodSpec
from pdrom.metrics import relative_errors
from pdrom.provenance import attributes
from pdrom.rom.local_step import ReducedLocalStep
from pdrom.rom.rerun import Rerun, displacement_norms, replace_group, rerun
from pdrom.sampling import Reduction, select
from pdrom.snapshots import SPLITS, SnapshotSet, load_snapshots
from pdrom.stages.scenes import scene_of
from pdrom.store import open_hdf5, write_hdf5, write_table

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "direction", "rung", "r", "condition", "gain", "elements_sampled",
    "error_train", "error_test", "error_heldout", "frames", "finite", "blowup_frame",
]  # fmt: skip


def climb(
    labels: dict[str, str],
    scene: dict[str, Any],
    ladder: dict[str, Any],
    blowup_extent: float,
    solver: str,
    mesh: str,
    fom: str,
    snapshots: str,
    table_output: str,
    runs_output: str,
) -> None:
    """Reduce and rerun the scene with every rung; write a table and the differences by frame.

    Parameters
    ----------
    runs_output : HDF5 with "displacement" (F,) and for row i of the table "i/difference" (F',), m;
        the horizon is applied to them when the table ladder is made
    """
    bound, data = scene_of(scene, mesh), load_snapshots(snapshots)
    with open_hdf5(fom) as file:
        reference = file["positions"][...]
    system = bound.system_with(solver)
    group = bound.group(labels["group"])
    spec = LadderSpec.model_validate(ladder)
    rows = []
    with write_hdf5(runs_output) as file:
        file.attrs.update(attributes({**labels, "ladder": ladder, "scene": scene}))
        file["displacement"] = displacement_norms(reference)
        for i, (direction, method, seed) in enumerate(spec.rungs()):
            row = {**labels, "direction": direction, "rung": _name(method, seed), "r": spec.r}
            store = file.create_group(str(i))
            store.attrs.update(direction=direction, rung=row["rung"])
            reduction = _reduce(data, method, spec.r, seed)
            if reduction is not None:
                steps = replace_group(bound, group.name, ReducedLocalStep(group, reduction))
                outcome = rerun(bound, system, steps, reference, blowup_extent)
                store["difference"] = outcome.difference
                row |= {"r": reduction.r, **_measures(reduction, data), **_run(outcome)}
            rows.append(row)
            log.info("%s, %s", direction, row["rung"])
    table = pd.DataFrame(rows, columns=COLUMNS)
    for column in ("r", "elements_sampled", "frames", "blowup_frame"):
        table[column] = table[column].astype("Int64")
    write_table(table, table_output)


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
        # the rounding errors of n snapshots grow like sqrt(n)
        roundoff = data.roundoff * np.sqrt(len(p) / len(data.train))
        errors[f"error_{split}"] = relative_errors(p, reduction.reconstruct(p), roundoff)[0]
    return {
        "condition": reduction.condition,
        "gain": reduction.gain,
        "elements_sampled": len(reduction.elements),
        **errors,
    }


def _run(outcome: Rerun) -> dict[str, Any]:
    return {
        "frames": outcome.frames,
        "finite": outcome.blowup_frame is None,
        "blowup_frame": outcome.blowup_frame,
    }
