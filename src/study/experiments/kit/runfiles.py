"""Functions that load reductions, find bases, compute errors of runs, and store runs."""

import os
from collections.abc import Sequence

import h5py
import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.model.metrics import trajectory_error
from pdrom.reduction.basis import Basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.rerun import Rerun, displacement_norms
from pdrom.reduction.sampling.reduction import Reduction, Sampling
from study.artifact.paths import File


def load_reduction(
    basis: Basis, sampling: str | os.PathLike[str], method: MethodSpec, r: int
) -> Reduction:
    """Load the reduction of size ``r`` from ``sampling``; StorageError if the file has none."""
    with open_hdf5(sampling) as file:
        store = file[f"r{r:04d}"]
        stored = Sampling(store["entries"][...], store["elements"][...])
    return Reduction(basis, stored, method, r=r)


def basis_of(sampling: File, method: MethodSpec, bases: Sequence[File]) -> File:
    """Return the file in ``bases`` from whose basis the samples in ``sampling`` were selected.

    ``method`` selected them. Raises StorageError if the basis is not among the files.
    """
    wanted = {"scene": sampling["scene"], "group": sampling["group"], "basis": method.basis_id}
    for basis in bases:
        if basis.labels == wanted:
            return basis
    raise StorageError(f"{sampling.path}: its basis {method.basis_id} is not among the files read")


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
