"""Models of position subspaces, stored in HDF5 and loaded again."""

import os
from collections.abc import Mapping
from typing import Any

import h5py

from pdrom.core.store import open_hdf5
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import Samples, SubspaceModel


def store_columns(store: h5py.Group, columns: Columns) -> None:
    """Write the ``columns`` of a subspace into the HDF5 group ``store``."""
    store["B"], store["free"] = columns.B, columns.free
    store.attrs["modes"] = columns.modes
    for i, (atom, own) in enumerate(zip(columns.atoms, columns.atom_columns, strict=True)):
        store[f"atoms/{i:04d}/vertices"], store[f"atoms/{i:04d}/columns"] = atom, own


def store_model(
    store: h5py.Group, labels: dict[str, Any], samples: Mapping[str, Samples | Interpolation]
) -> None:
    """Write a model's ``labels`` and ``samples`` of each group to the HDF5 group ``store``."""
    store.attrs.update(labels)
    for name, chosen in samples.items():
        if isinstance(chosen, Interpolation):
            chosen.save(store.create_group(f"samples/{name}"))
            continue
        store[f"samples/{name}/elements"] = chosen.elements
        store[f"samples/{name}/factors"] = chosen.factors


def load_models(path: str | os.PathLike[str]) -> list[tuple[dict[str, object], SubspaceModel]]:
    """Labels (method, position_basis, k) and models of the file ``path``, in order."""
    with open_hdf5(path) as file:
        columns = {base: _columns(store) for base, store in file["columns"].items()}
        models = []
        for store in file["models"].values():
            base = str(store.attrs["base"])
            labels = {key: store.attrs[key] for key in ("method", "position_basis", "k")}
            labels["k"] = int(labels["k"])
            samples = {
                name: Interpolation.load(chosen)
                if "operator" in chosen
                else Samples(chosen["elements"][...], chosen["factors"][...])
                for name, chosen in store.get("samples", {}).items()
            }
            model = SubspaceModel(str(labels["position_basis"]), columns[base], samples)
            models.append((labels, model))
    return models


def _columns(store: h5py.Group) -> Columns:
    atoms = list(store["atoms"].values()) if "atoms" in store else []
    return Columns(
        B=store["B"][...],
        free=store["free"][...],
        atoms=[a["vertices"][...] for a in atoms],
        atom_columns=[a["columns"][...] for a in atoms],
        modes=int(store.attrs["modes"]),
    )
