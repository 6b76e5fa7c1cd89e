"""Functions that load reductions, find bases, compute errors of runs, and store runs."""

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import h5py
import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.model.metrics import trajectory_error
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.sampling.reduction import Reduction, Sampling
from study.artifact.paths import File
from study.experiments.kit import base as kit

Methods = Mapping[str, MethodSpec]


def load_reduction(
    basis: Basis, sampling: str | os.PathLike[str], method: MethodSpec, r: int
) -> Reduction:
    """Load the reduction of size ``r`` from ``sampling``; StorageError if the file has none."""
    with open_hdf5(sampling) as file:
        store = file[f"r{r:04d}"]
        stored = Sampling(store["entries"][...], store["elements"][...])
    return Reduction(basis, stored, method, r=r)


def projection_models(
    samplings: Sequence[File], bases: Sequence[File], methods: Methods, ranks: Sequence[kit.Rank]
) -> Iterator[tuple[dict[str, Any], ProjectionModel | None]]:
    """Yield labels (group, method, r) and model for each of ``samplings`` and basis size r.

    ``ranks`` are the sizes; the model is None if the file has no samples of this size. StorageError
    if the basis of samples is not among the files ``bases``.
    """
    for file in samplings:
        spec, group = methods[file["method"]], file["group"]
        wanted = {"scene": file["scene"], "group": group, "basis": spec.basis_id}
        found = next((each for each in bases if each.labels == wanted), None)
        if found is None:
            fault = f"its basis {spec.basis_id} is not among the files read"
            raise StorageError(f"{file.path}: {fault}")
        basis = load_basis(found.path)
        with open_hdf5(file.path) as stored:
            held = set(stored)
        for r in kit.resolve_ranks(ranks, basis.rank):
            model = None
            if f"r{r:04d}" in held:
                model = ProjectionModel(group, load_reduction(basis, file.path, spec, r=r))
            yield {"group": group, "method": file["method"], "r": r}, model


def run_error(run: np.ndarray, reference: np.ndarray) -> float | None:
    """Relative error of ``run`` (F + 1, N, 3) m against ``reference``; None if this never moves."""
    difference = np.linalg.norm((run - reference)[1:].reshape(len(run) - 1, -1), axis=1)
    return trajectory_error(difference, displacement_norms(reference))


def store_end(store: h5py.Group, outcome: Rerun, with_positions: bool = True) -> None:
    """Store a run's blow-up frame, `Rerun.max_extent` and, if asked, single-precision positions."""
    blowup = -1 if outcome.blowup_frame is None else outcome.blowup_frame
    store.attrs.update(blowup_frame=blowup, max_extent=outcome.max_extent)
    if with_positions:
        store["positions"] = outcome.positions.astype(np.float32)
