"""Export of a subspace model as plain data for the browser's simulation code (`engine.js`).

The engine computes strains and the reduced system from basis, rest shape and samples, by the
formulas of `pdrom.reduction.subspace`. Exported numbers are doubles unless stated otherwise.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np

from pdrom.core.errors import SceneError, choices
from pdrom.core.packed import pack_array
from pdrom.model.constraints.base import ConstraintGroup, StencilGroup
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import Force, Start
from pdrom.model.effects.hold import Pins
from pdrom.model.effects.obstacle import Floor
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.subspace.columns import Columns
from pdrom.reduction.subspace.interpolation import Interpolation
from pdrom.reduction.subspace.model import Samples, SubspaceModel
from pdrom.reduction.subspace.space import PROBES, ReducedSpace, probe_vertices, reduced_state

# Bases of more entries are exported in single precision, except rows of sampled or probe vertices.
DOUBLES = 60_000
MANIFOLDS = ("clamped", "length")


def export_scene(scene: Scene) -> dict[str, Any]:
    """Export the data of ``scene`` that all its subspace models have in common.

    SceneError if the browser's simulation code lacks a constraint group or effect of the scene.
    """
    require_known(scene.config)
    floors = [contact.config.height for contact in scene.contacts]
    return {
        "timeStep": scene.config.time_step,
        "iterations": scene.config.iterations,
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
            raise SceneError(
                f"scene '{config.name}': the page's engine has no '{name}'"
                f"{choices(name, (*allowed, 'floor', 'pins'))}"
            )
    if config.anderson_window:
        raise SceneError(
            f"scene '{config.name}': anderson_window = {config.anderson_window}: the page's engine "
            "has no acceleration (allowed: 0)"
        )


def export_basis(scene: Scene, columns: Columns, needed: np.ndarray) -> dict[str, Any]:
    """Export the data that models of ``scene`` with the same ``columns`` share.

    They are the columns, the inertia matrix, the initial state and the forces in the subspace. Rows
    of the ``needed`` vertices (n,), which iterations use, are always exported as doubles.
    """
    space = ReducedSpace(scene, columns, [])
    start = reduced_state(scene, columns)
    exact = columns.B.size <= DOUBLES
    rows = np.unique(np.concatenate([needed, probe_vertices(scene.mesh.vertices)]))
    return {
        "B": pack_array(columns.B, "f8" if exact else "f4"),
        "exact": None
        if exact
        else {"vertices": pack_array(rows, "u4"), "rows": pack_array(columns.B[rows], "f8")},
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


def export_model(scene: Scene, model: SubspaceModel) -> dict[str, Any]:
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
        groups[group.name] = {"stencil": pack_array(_stencil(group, chosen), "u4"), **packed}
    return {"evaluated": model.elements_evaluated(scene), "groups": groups}


def _stencil(group: ConstraintGroup, chosen: Samples | Interpolation) -> np.ndarray:
    """Vertex indices (m, corners) of the m sampled elements of ``group``."""
    assert isinstance(group, StencilGroup)  # `require_known` refuses other groups
    return group.stencil[chosen.elements]


def needed_vertices(scene: Scene, models: Iterable[SubspaceModel]) -> np.ndarray:
    """Vertices (n,) of all elements of ``scene`` that any of the ``models`` samples."""
    found = [_stencil(g, model.chosen(g)).ravel() for model in models for g in scene.groups]
    return np.unique(np.concatenate([np.empty(0, np.int64), *found]))
