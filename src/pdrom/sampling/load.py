"""A reduction from its files."""

import os

from pdrom.basis.types import Basis
from pdrom.method import MethodSpec
from pdrom.sampling.reduction import Reduction
from pdrom.sampling.types import Sampling
from pdrom.store import open_hdf5


def load_reduction(
    basis: Basis, sampling: str | os.PathLike[str], method: MethodSpec, r: int
) -> Reduction:
    """The stored reduction of size r; StorageError if the file does not hold it."""
    with open_hdf5(sampling) as file:
        store = file[f"r{r:04d}"]
        stored = Sampling(store["entries"][...], store["elements"][...])
    return Reduction(basis, stored, method, r)
