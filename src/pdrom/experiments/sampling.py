"""Rule reruns, first part: basis -> sampled entries, reconstruction errors over the sweep of r."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.metrics import relative_errors
from pdrom.core.provenance import attributes
from pdrom.core.store import write_hdf5, write_table
from pdrom.pipeline.study import Rank, Sweep
from pdrom.reduction.basis import load_basis
from pdrom.reduction.local.ranks import resolve_ranks
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, Sampling, select_path
from pdrom.reduction.snapshots import SPLITS, SnapshotSet, load_snapshots

log = logging.getLogger(__name__)


def sample(
    labels: dict[str, str],
    spec: dict[str, Any],
    sweep: dict[str, int],
    ranks: list[Rank],
    snapshots: str,
    basis: str,
    sampling_output: str,
    errors_output: str,
) -> None:
    """Select samples for every r of the sweep and of the reruns; write them and the error table.

    Parameters
    ----------
    labels : scene, group and method, the first columns of the table
    """
    method = MethodSpec.model_validate(spec)
    space, data = load_basis(basis), load_snapshots(snapshots)
    wanted = _sizes(Sweep.model_validate(sweep), ranks, space.rank)
    path = select_path(space, method, wanted) if wanted else {}
    rows = []
    with write_hdf5(sampling_output) as file:
        file.attrs.update(attributes({**labels, "spec": spec}))
        for r in wanted:
            reduction = Reduction(space, path[r], method, r)
            _store(file, r, path[r], reduction)
            rows += [{**labels, "r": r, **row} for row in _errors(reduction, data)]
    beyond = [r for r in resolve_ranks(ranks, space.rank) if r > space.rank]
    rows += [{**labels, "r": r, "split": split} for r in beyond for split in SPLITS]
    if beyond:
        log.warning("r = %s exceeds the numerical rank %d: marked rows", beyond, space.rank)
    write_table(pd.DataFrame(rows, columns=_COLUMNS), errors_output)


_COLUMNS = [
    "scene", "group", "method", "r", "split",
    "relative_error", "relative_error_x", "relative_error_y", "relative_error_z",
    "gain", "rows_sampled", "elements_sampled",
]  # fmt: skip


def _sizes(sweep: Sweep, ranks: list[Rank], rank: int) -> list[int]:
    """Sizes of sweep and reruns that the basis can have, ascending."""
    if rank == 0:
        return []
    asked = [r for r in resolve_ranks(ranks, rank) if r <= rank]
    return sorted({*sweep.ranks(rank), *asked})


def _store(file, r: int, sampling: Sampling, reduction: Reduction) -> None:
    store = file.create_group(f"r{r:04d}")
    store["entries"], store["elements"] = sampling.entries, sampling.elements
    store.attrs["gain"], store.attrs["condition"] = reduction.gain, reduction.condition


def _errors(reduction: Reduction, data: SnapshotSet) -> list[dict[str, Any]]:
    rows = []
    for split in SPLITS:
        p = getattr(data, split)
        # the rounding errors of n snapshots grow like sqrt(n)
        roundoff = data.roundoff * np.sqrt(len(p) / len(data.train))
        total, x, y, z = relative_errors(p, reduction.reconstruct(p), roundoff)
        rows.append(
            {
                "split": split,
                "relative_error": total,
                "relative_error_x": x,
                "relative_error_y": y,
                "relative_error_z": z,
                "gain": reduction.gain,
                "rows_sampled": reduction.rows_sampled,
                "elements_sampled": len(reduction.elements),
            }
        )
    return rows
