"""Export of a subspace model as plain data for the browser's simulation code (`engine.js`).

The engine computes strains and the reduced system from basis, rest shape and samples, by the
formulas of `pdrom.reduction.subspace`. Exported numbers are doubles unless stated otherwise.
"""

import json
import os
from collections.abc import Iterable, Sequence
from math import ceil
from typing import Any

import numpy as np

from pdrom.core.errors import SceneError, StorageError, choices
from pdrom.core.packed import pack_array, pack_positions
from pdrom.core.store import write_text
from pdrom.model.constraints.base import ConstraintGroup, StencilGroup
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import Force, Start
from pdrom.model.effects.hold import Pins
from pdrom.model.effects.obstacle import Floor
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import mean_motion
from pdrom.reduction.subspace.ecsw import Samples
from pdrom.reduction.subspace.model import Labelled, SubspaceModel
from pdrom.reduction.subspace.space import PROBES, ReducedSpace, probe_vertices, reduced_state

# Larger bases are exported in single precision, except rows of sampled and probe vertices.
DOUBLES = 60_000
MANIFOLDS = ("clamped", "length")
LARGEST = 3_000_000  # largest size of a file for the page, bytes
GHOST = 250_000  # approximate limit of vertex positions of the full-order run in the file
FORMAT = 1


def export_scene(scene: Scene) -> dict[str, Any]:
    """Export the data of ``scene`` that all its subspace models have in common.

    SceneError if the browser's simulation code lacks a constraint group or effect of the scene.
    """
    require_known(scene.config)
    floors = [contact.config.height for contact in scene.contacts]
    return {
        "timeStep": scene.config.time_step,
        "iterations": scene.config.count,
        "frames": scene.config.frames,
        "points": pack_array(scene.mesh.points, "f8"),
        "masses": pack_array(scene.masses, "f8"),
        "floors": floors,
        "probes": PROBES,
        "holds": [
            {
                "name": b.side or b.name,
                "from": b.config.start,
                "until": b.config.until,
                "vertices": b.vertices.tolist(),
            }
            for b in scene.boundaries
        ],
        "groups": {
            group.name: {
                "kind": group.manifold,
                "rows": group.rows_per_element,
                "range": group.kernel_parameters().tolist()
                if group.manifold == "clamped"
                else None,
                "elements": group.elements,
            }
            for group in scene.groups
        },
    }


def require_known(config: SceneConfig) -> None:
    """Raise SceneError if the browser's simulation code cannot run the scene of ``config``."""
    for name in (each.effect for each in config.effects):
        effect = EFFECTS.load(name)
        projected = issubclass(effect, StencilGroup) and effect.manifold in MANIFOLDS
        if not (projected or issubclass(effect, (Floor, Pins, Force, Start))):
            allowed = ("spring", "strain", "tetrahedron_strain", "deformation_gradient")
            added = " (added by poisson > 0)" * (name in ("area", "volume"))
            raise SceneError(
                f"scene '{config.name}': the page's engine has no '{name}'{added}"
                f"{choices(name, (*allowed, 'floor', 'pins'))}"
            )
    if config.anderson_window:
        raise SceneError(
            f"scene '{config.name}': anderson_window = {config.anderson_window}: the page's engine "
            "has no acceleration (allowed: 0)"
        )


def _basis(scene: Scene, models: Sequence[SubspaceModel]) -> dict[str, Any]:
    """Export the data that ``models`` with the same columns share.

    Rows of vertices that iterations use are always exported as doubles.
    """
    columns = models[0].columns
    space, start = ReducedSpace(scene, columns, []), reduced_state(scene, columns)
    needed, exact = needed_vertices(scene, models), columns.B.size <= DOUBLES
    rows = np.unique(np.concatenate([needed, probe_vertices(scene.mesh.vertices)]))
    kept = {"vertices": pack_array(rows, "u4"), "rows": pack_array(columns.B[rows], "f8")}
    return {
        "B": pack_array(columns.B, "f8" if exact else "f4"),
        "exact": None if exact else kept,
        "atoms": [atom.tolist() for atom in columns.atoms],
        "atomColumns": [own.tolist() for own in columns.atom_columns],
        "inertia": pack_array(space.inertia_matrix, "f8"),
        "positions": pack_array(start.positions, "f8"),
        "velocities": pack_array(start.velocities, "f8"),
        "forces": [
            {"constant": pack_array(constant, "f8"), "rate": pack_array(np.atleast_2d(rate), "f8")}
            for constant, rate in space.forces
        ],
    }


def _model(scene: Scene, model: SubspaceModel) -> dict[str, Any]:
    """Export each group's elements sampled by ``model``, with weights or interpolation matrices."""
    groups = {}
    for group in scene.groups:
        chosen = model.chosen(group)
        if isinstance(chosen, Samples):
            arrays = {"weights": group.weights[chosen.elements] * chosen.factors}
        else:
            names = ("operator", "modes", "offset", "stiffness")
            arrays = {name: getattr(chosen, name) for name in names}
        packed = {name: pack_array(array, "f8") for name, array in arrays.items()}
        groups[group.name] = {"stencil": pack_array(_stencil(group, model), "u4"), **packed}
    return {"evaluated": model.elements_evaluated(scene), "groups": groups}


def _stencil(group: ConstraintGroup, model: SubspaceModel) -> np.ndarray:
    """Vertex indices (m, corners) of the m elements of ``group`` that ``model`` samples."""
    assert isinstance(group, StencilGroup)  # `require_known` refuses other groups
    return group.stencil[model.chosen(group).elements]


def needed_vertices(scene: Scene, models: Iterable[SubspaceModel]) -> np.ndarray:
    """Return vertices (n,) of all elements of ``scene`` that ``models`` sample."""
    found = [_stencil(group, model).ravel() for model in models for group in scene.groups]
    return np.unique(np.concatenate([np.empty(0, np.int64), *found]))


def write_page_models(
    scene: Scene,
    title: str,
    reference: np.ndarray,
    models: Sequence[Labelled],
    path: str | os.PathLike[str],
) -> None:
    """Write `export_page` to a script that a page loads; StorageError if above `LARGEST` bytes."""
    content = export_page(scene, title, reference, models)
    text = f"pdromLive({json.dumps(content, separators=(',', ':'), allow_nan=False)});\n"
    if len(text) > LARGEST:
        raise StorageError(
            f"{path}: {len(text) / 1e6:.1f} MB, allowed are {LARGEST / 1e6:.1f}: choose fewer "
            "sizes or tolerances (keys live.sizes, live.tolerances)"
        )
    write_text(text, path)


def export_page(
    scene: Scene, title: str, reference: np.ndarray | None, models: Sequence[Labelled]
) -> dict[str, Any]:
    """Export ``models``, with labels that the page shows, and a full-order run of ``scene``.

    ``reference`` (F + 1, N, 3) m are positions of the run, of which some frames are shown; None
    without a run. SceneError if the browser's code cannot run the scene.
    """
    full = scene.mesh.points[None] if reference is None else reference
    used, triangles = np.unique(scene.mesh.triangles, return_inverse=True)
    stride = max(1, ceil((len(full) - 1) * len(used) / GHOST))
    of_basis: dict[int, list[SubspaceModel]] = {}
    for _, model in models:
        of_basis.setdefault(id(model.columns), []).append(model)
    places = list(of_basis)
    return {
        "format": FORMAT,
        "scene": scene.config.name,
        "title": title,
        **export_scene(scene),
        "bases": [_basis(scene, own) for own in of_basis.values()],
        "models": [
            {**labels, "basis": places.index(id(model.columns)), **_model(scene, model)}
            for labels, model in models
        ],
        # the surface, and positions of its vertices in every ``stride``-th full-order frame
        "shown": {
            "vertices": pack_array(used, "u4"),
            "triangles": pack_array(triangles.reshape(-1, 3), "u4"),
            "stride": stride,
            "full": pack_positions(full[::stride, used]),
        },
        "motion": None if reference is None else mean_motion(reference),
    }
