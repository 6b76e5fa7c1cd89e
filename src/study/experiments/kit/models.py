"""Load reduced models of a scene from the files of the study."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.reduction.basis import Basis, load_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.sampling.reduction import Reduction, Sampling
from pdrom.reduction.subspace.model import SubspaceModel, load_models
from study.artifact.paths import File
from study.experiments.kit import base as kit
from study.experiments.kit.runs import Row

Model = ProjectionModel | SubspaceModel
Methods = Mapping[str, MethodSpec]


def load_reduction(
    basis: Basis, sampling: str | os.PathLike[str], method: MethodSpec, r: int
) -> Reduction:
    """Load the reduction of size ``r`` from ``sampling``; StorageError if the file has none."""
    with open_hdf5(sampling) as file:
        store = file[f"r{r:04d}"]
        stored = Sampling(store["entries"][...], store["elements"][...])
    return Reduction(basis, stored, method, r=r)


def stored_models(
    samplings: Sequence[File], bases: Sequence[File], methods: Methods,
    ranks: Sequence[kit.Rank], subspaces: Iterable[File] = (),
) -> Iterator[tuple[Row, Model | None]]:  # fmt: skip
    """Yield labels (columns of tables) and model for each stored model.

    First come the models of each of ``samplings`` and each basis size r in ``ranks`` (None if the
    basis has fewer modes), then the models in the files ``subspaces``. Raises StorageError if the
    basis of samples is not among the files ``bases``.
    """
    for file in samplings:
        spec = methods[file["method"]]
        wanted = {"scene": file["scene"], "group": file["group"], "basis": spec.basis_id}
        found = next((each for each in bases if each.labels == wanted), None)
        if found is None:
            raise StorageError(f"{file.path}: the job does not read its basis {spec.basis_id}")
        basis = load_basis(found.path)
        for r in kit.resolve_ranks(ranks, basis.rank):
            own: Row = {"group": file["group"], "method": file["method"], "r": r}
            model = None
            if r <= basis.rank:
                reduction = load_reduction(basis, file.path, spec, r=r)
                model = ProjectionModel(file["group"], reduction)
                own["gain"] = reduction.gain
            yield own, model
    for file in subspaces:
        for own, subspace in load_models(file.path):
            yield {"group": "all", **own}, subspace
