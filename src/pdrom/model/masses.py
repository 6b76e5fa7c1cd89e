"""Lumped masses of the vertices: one for all, or by selection."""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.core.errors import SceneError
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.mesh.measures import vertex_measures
from pdrom.model.mesh.select import select_vertices
from pdrom.model.mesh.selection import Selection
from pdrom.model.mesh.types import Mesh

Mass = Annotated[float, Field(ge=1e-150, le=1e150)]


class MassConfig(ConfigModel):
    """Mass of the vertices of ``select`` (all if it is left out), given in one of two ways.

    vertex_mass : kg a vertex
    density : kg/m^2 of a surface, kg/m^3 of a volume; a vertex has its share of the rest shape
    """

    select: Selection | None = None
    vertex_mass: Mass | None = None
    density: Mass | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.vertex_mass is None) == (self.density is None):
            raise ValueError("either vertex_mass or density is required")
        return self


def vertex_masses(
    mesh: Mesh, scene: str, vertex_mass: float, entries: tuple[MassConfig, ...]
) -> np.ndarray:
    """Masses (N,) kg of ``scene``: ``vertex_mass``, changed by each of ``entries`` in turn.

    Raises
    ------
    SceneError
        A selection that the mesh does not have.
    """
    masses = np.full(mesh.vertices, vertex_mass)
    for number, entry in enumerate(entries):
        try:
            masses = _changed(masses, mesh, entry)
        except SceneError as error:
            raise SceneError(f"scene '{scene}', masses[{number}]: {error}") from error
    return masses


def _changed(masses: np.ndarray, mesh: Mesh, entry: MassConfig) -> np.ndarray:
    chosen = np.arange(mesh.vertices)
    if entry.select is not None:
        chosen = select_vertices(mesh, entry.select)
    masses = masses.copy()
    if entry.density is None:
        masses[chosen] = entry.vertex_mass
    else:
        masses[chosen] = entry.density * vertex_measures(mesh)[chosen]
    return masses
