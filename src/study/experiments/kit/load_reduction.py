"""A reduction from its files."""

import os
from collections.abc import Sequence

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.reduction.basis import Basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.reduction import Reduction, Sampling
from study.artifact.paths import File


def load_reduction(
    basis: Basis, sampling: str | os.PathLike[str], method: MethodSpec, r: int
) -> Reduction:
    """Reduction of size r by ``method``, ``basis`` and the file ``sampling``, or StorageError."""
    with open_hdf5(sampling) as file:
        store = file[f"r{r:04d}"]
        stored = Sampling(store["entries"][...], store["elements"][...])
    return Reduction(basis, stored, method, r=r)


def basis_of(sampling: File, method: MethodSpec, bases: Sequence[File]) -> File:
    """Basis among ``bases`` that ``method`` needs for the file ``sampling``; else StorageError."""
    wanted = {"scene": sampling["scene"], "group": sampling["group"], "basis": method.basis_id}
    for basis in bases:
        if basis.labels == wanted:
            return basis
    raise StorageError(f"{sampling.path}: its basis {method.basis_id} is not among the files read")
