"""Arguments of the functions of `pdrom.api`: a wrong one is named before anything is computed."""

import os
from numbers import Integral
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from pdrom.api.records import FullRun
from pdrom.core import config_file
from pdrom.core.errors import ConfigurationError, SnapshotError, choices
from pdrom.core.store import require_finite
from pdrom.core.yamlfile import shown
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.basis import Basis
from pdrom.reduction.method import MethodSpec, load_methods

T = TypeVar("T")


def require(kind: type[T] | tuple[type[T], ...], value: Any, name: str, source: str) -> T:
    """Return ``value`` if it is a ``kind``, else raise an error with ``name`` and ``source``."""
    if isinstance(value, kind):
        return value
    kinds = " or ".join(k.__name__ for k in (kind if isinstance(kind, tuple) else (kind,)))
    raise ConfigurationError(f"{name} = {shown(value, 60)}: a {kinds} is required ({source})")


def file_path(path: Any) -> Path:
    """Return ``path`` as a `Path`; ConfigurationError if it cannot be one."""
    if not isinstance(path, (str, os.PathLike)) or "\0" in str(path):
        raise ConfigurationError(f"{shown(path, 60)}: the name of a file is required")
    return Path(path)


def require_positions(full: FullRun) -> None:
    """SnapshotError if the positions of ``full`` are not all of its frames, or not finite."""
    scene = full.scene
    shape = (scene.config.frames + 1, scene.mesh.vertices, 3)
    if np.shape(full.positions) != shape:
        raise SnapshotError(
            f"full: positions of shape {np.shape(full.positions)}, required: {shape}"
        )
    require_finite("full: positions", full.positions, SnapshotError)


def modes(r: Any) -> int:
    """Return the number of modes ``r`` as an int; its range is checked with the basis."""
    if isinstance(r, bool) or not isinstance(r, Integral):
        raise ConfigurationError(f"r = {shown(r, 60)}: a whole number of modes is required")
    return int(r)


def method_spec(method: str | MethodSpec) -> MethodSpec:
    """Return the method of that name in config/methods.yaml; a specification as it is."""
    if isinstance(method, MethodSpec):
        return method
    known = methods()
    if not isinstance(method, str) or method not in known:
        raise ConfigurationError(f"unknown method {shown(method, 60)}{choices(method, known)}")
    return known[method]


def methods() -> dict[str, MethodSpec]:
    """Reduction methods of config/methods.yaml by name; an installed package has its own copy."""
    return load_methods(config_file("methods.yaml"))


def fitting_basis(made: Any, group: ConstraintGroup, spec: MethodSpec) -> Basis:
    """Return ``made`` if the method ``spec`` can use it as a basis of the group, else raise."""
    basis = require(Basis, made, "basis_of_group", source="pdrom.api.basis makes one")
    found, needed = ((each.elements, each.rows_per_element) for each in (basis, group))
    if found != needed:
        raise ConfigurationError(
            f"basis_of_group: of {found[0]} elements with {found[1]} rows each, group "
            f"'{group.name}' of this scene has {needed[0]} with {needed[1]}: another scene's?"
        )
    if basis.V.shape != (len(basis.mean), basis.rank):
        raise ConfigurationError(
            f"basis_of_group: V of shape {basis.V.shape}, required: {(len(basis.mean), basis.rank)}"
        )
    if basis.separate_axes != spec.separate_axes:
        raise ConfigurationError(
            f"basis_of_group: made for another method than '{spec.title}' (axes "
            f"{'apart' if basis.separate_axes else 'together'})"
        )
    return basis
