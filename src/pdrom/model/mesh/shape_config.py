"""Typed configuration of the unstructured meshes of `pdrom.model.mesh.shapes`."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pdrom.model.mesh.generators import Plane
from pdrom.model.mesh.lengths import Length, PositiveLength
from pdrom.model.mesh.limits import MAX_VERTICES
from pdrom.model.mesh.mesh_model import MeshModel
from pdrom.model.mesh.shapes import disc, shell, solid
from pdrom.model.mesh.types import Mesh

Shape = Literal["ball", "torus", "starfish"]
FEWEST_EDGES = 8  # along the extent


class _Unstructured(MeshModel):
    """Base of the meshes of `pdrom.model.mesh.shapes`; ``edge`` is the length of an edge, about."""

    edge: PositiveLength
    extent: PositiveLength = 1.0
    lift: Length = 2.0

    def expected(self, edges: float) -> float:
        """Upper bound on the vertices, with so many edges along the extent."""
        raise NotImplementedError(f"{type(self).__name__} expects no number of vertices")

    @model_validator(mode="after")
    def _neither_coarse_nor_large(self) -> Self:
        edges = self.extent / self.edge
        if edges < FEWEST_EDGES:
            raise ValueError(
                f"edge = {self.edge:g}: allowed is at most {self.extent / FEWEST_EDGES:g}, the "
                f"extent over {FEWEST_EDGES}"
            )
        if self.expected(edges) > MAX_VERTICES:
            raise ValueError(
                f"edge = {self.edge:g} makes about {self.expected(edges):.0f} vertices, allowed: "
                f"at most {MAX_VERTICES}"
            )
        return self

    def coarsened(self, factor: float) -> Self:
        """Make the edges 1 / ``factor`` times as long."""
        longest = self.extent / FEWEST_EDGES
        return self.model_copy(update={"edge": min(self.edge / factor, longest)})


class DiscMesh(_Unstructured):
    """Disc of `pdrom.model.mesh.shapes.disc`; ``hole`` is its diameter over that of the disc."""

    kind: Literal["disc"]
    hole: Annotated[float, Field(ge=0.0, le=0.9)] = 0.3
    plane: Plane = "xz"

    def expected(self, edges: float) -> float:
        return 1.4 * edges**2

    def build(self, root: Path) -> Mesh:
        """Generate the mesh; nothing is read below ``root``."""
        return disc(self.edge, self.hole, self.plane, extent=self.extent, lift=self.lift)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"disc_{self.edge:g}"


class ShellMesh(_Unstructured):
    """Closed surface of `pdrom.model.mesh.shapes.shell`."""

    kind: Literal["shell"]
    shape: Shape

    def expected(self, edges: float) -> float:
        return 5.5 * edges**2

    def build(self, root: Path) -> Mesh:
        """Generate the mesh; nothing is read below ``root``."""
        return shell(self.shape, self.edge, self.extent, lift=self.lift)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"shell_{self.shape}_{self.edge:g}"


class SolidMesh(_Unstructured):
    """Tetrahedra of `pdrom.model.mesh.shapes.solid`."""

    kind: Literal["solid"]
    shape: Shape

    def expected(self, edges: float) -> float:
        return 1.5 * edges**3

    def build(self, root: Path) -> Mesh:
        """Generate the mesh; nothing is read below ``root``."""
        return solid(self.shape, self.edge, self.extent, lift=self.lift)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"solid_{self.shape}_{self.edge:g}"
