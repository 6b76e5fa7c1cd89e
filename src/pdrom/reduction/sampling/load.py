"""A reduction from its files."""

import os

from pdrom.core.store import open_hdf5
from pdrom.reduction.basis.types import Basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.reduction import Reduction
from pdrom.reduction.sampling.types import Sampling


def load_reduction(
    basis: Basis, sampling: str | os.PathLike[str], method: MethodSpec, r: int
) -> Reduction:
    """The stored reduction of size r; StorageError if the file does not hold it."""
    with open_hdf5(sampling) as file:
        store = file[f"r{r:04d}"]
        stored = Sampling(store["entries"][...], store["elements"][...])
    return Reduction(basis, stored, method, r)
