"""Hyper-reduced models from the file that rule hyper wrote."""

import os

from pdrom.core.store import open_hdf5
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import Samples, SubspaceModel


def load_models(path: str | os.PathLike[str]) -> list[tuple[dict[str, object], SubspaceModel]]:
    """Labels (method, position_basis, k) and model of everything in the file, in order."""
    with open_hdf5(path) as file:
        columns = {base: _columns(store) for base, store in file["columns"].items()}
        models = []
        for store in file["models"].values():
            base = str(store.attrs["base"])
            labels = {key: store.attrs[key] for key in ("method", "position_basis", "k")}
            labels["k"] = int(labels["k"])
            model = SubspaceModel(str(labels["position_basis"]), columns[base], _samples(store))
            models.append((labels, model))
    return models


def _columns(store) -> Columns:
    atoms = list(store["atoms"].values()) if "atoms" in store else []
    return Columns(
        B=store["B"][...],
        free=store["free"][...],
        atoms=[a["vertices"][...] for a in atoms],
        atom_columns=[a["columns"][...] for a in atoms],
        modes=int(store.attrs["modes"]),
    )


def _samples(store) -> dict[str, Samples | Interpolation]:
    if "samples" not in store:
        return {}
    return {name: _sampled(chosen) for name, chosen in store["samples"].items()}


def _sampled(chosen) -> Samples | Interpolation:
    if "operator" in chosen:
        return Interpolation.load(chosen)
    return Samples(chosen["elements"][...], chosen["factors"][...])
