"""Sampled entries of a basis, and reconstruction errors over the sweep of r."""

import logging
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import write_hdf5, write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.metrics import relative_errors
from pdrom.reduction.basis import Basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, reductions
from pdrom.reduction.snapshots import SPLITS, SnapshotSet
from study.artifact.paths import File
from study.experiments.kit.settings import Count, Rank, resolve_ranks

log = logging.getLogger(__name__)

COLUMNS = [
    "scene", "group", "method", "r", "split",
    "relative_error", "relative_error_x", "relative_error_y", "relative_error_z",
    "gain", "rows_sampled", "elements_sampled",
]  # fmt: skip


class Sweep(ConfigModel):
    """Basis sizes of the reconstruction error: all up to ``dense_to``, then every ``step``-th."""

    dense_to: Count = 10
    step: Count = 10

    def ranks(self, largest: int) -> list[int]:
        """Sizes 1 .. ``largest``, which is always among them."""
        dense = range(1, min(self.dense_to, largest) + 1)
        coarse = range(self.dense_to + self.step, largest + 1, self.step)
        return sorted({*dense, *coarse, largest} - {0})


def sample(
    basis: Basis,
    data: SnapshotSet,
    method: MethodSpec,
    sweep: Sweep,
    ranks: tuple[Rank, ...],
    sampling: File,
    errors: File,
) -> None:
    """Select samples for every r of the sweep and of the reruns; write them and the error table.

    Parameters
    ----------
    basis, data : of the group, from its training snapshots, and all of its snapshots
    method : its rows and criterion of the selection
    ranks : sizes of the reruns
    sampling, errors : files to write; their labels are the first columns of the table
    """
    labels = sampling.labels
    wanted = _sizes(sweep, ranks, basis.rank)
    rows = []
    with write_hdf5(sampling.path) as file:
        for r, reduction in reductions(basis, method, wanted).items():
            store, sampled = file.create_group(f"r{r:04d}"), reduction.sampling
            store["entries"], store["elements"] = sampled.entries, sampled.elements
            store.attrs["gain"], store.attrs["condition"] = reduction.gain, reduction.condition
            rows += [{**labels, "r": r, **row} for row in _errors(reduction, data)]
    beyond = [r for r in resolve_ranks(ranks, basis.rank) if r > basis.rank]
    rows += [{**labels, "r": r, "split": split} for r in beyond for split in SPLITS]
    if beyond:
        log.warning("r = %s exceeds the numerical rank %d: marked rows", beyond, basis.rank)
    write_table(pd.DataFrame(rows, columns=COLUMNS), errors.path)


def _sizes(sweep: Sweep, ranks: tuple[Rank, ...], rank: int) -> list[int]:
    """Sizes of sweep and reruns that the basis can have, ascending."""
    if rank == 0:
        return []
    asked = [r for r in resolve_ranks(ranks, rank) if r <= rank]
    return sorted({*sweep.ranks(rank), *asked})


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
