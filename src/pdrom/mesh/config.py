"""Typed configuration of a mesh: a generator with its parameters, or a file."""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, field_validator

from pdrom.mesh.files import read_mesh_file
from pdrom.mesh.generators import bar, cloth
from pdrom.mesh.types import Mesh

Count = Annotated[int, Field(ge=2, le=2000)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    @property
    def identifier(self) -> str:
        """File name of the mesh: readable, and different for different parameters."""
        canonical = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return f"{self.label}_{hashlib.sha256(canonical.encode()).hexdigest()[:8]}"


class ClothMesh(_Model):
    """Sheet of the generator `pdrom.mesh.generators.cloth`; lengths in metres."""

    kind: Literal["cloth"]
    rows: Count = 20
    columns: Count = 20
    plane: Literal["xy", "xz"] = "xy"
    extent: Positive = 1.0
    lift: FiniteFloat = 2.0
    wave: FiniteFloat = 0.0

    def coarsened(self, factor: float) -> Self:
        """Same sheet with ``factor`` times the vertices along each side, at least 4."""
        sizes = {name: max(4, round(getattr(self, name) * factor)) for name in ("rows", "columns")}
        return self.model_copy(update=sizes)

    def build(self, root: Path) -> Mesh:
        """Generate the mesh."""
        return cloth(self.rows, self.columns, self.plane, self.extent, self.lift, self.wave)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"cloth_{self.rows}x{self.columns}_{self.plane}"


class BarMesh(_Model):
    """Bar of the generator `pdrom.mesh.generators.bar`; lengths in metres."""

    kind: Literal["bar"]
    nx: Count = 40
    ny: Count = 5
    nz: Count = 5
    extent: Positive = 1.0
    lift: FiniteFloat = 2.0

    def coarsened(self, factor: float) -> Self:
        """Same bar with ``factor`` times the vertices along each side, at least 3."""
        sizes = {name: max(3, round(getattr(self, name) * factor)) for name in ("nx", "ny", "nz")}
        return self.model_copy(update=sizes)

    def build(self, root: Path) -> Mesh:
        """Generate the mesh."""
        return bar(self.nx, self.ny, self.nz, self.extent, self.lift)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"bar_{self.nx}x{self.ny}x{self.nz}"


class MeshFile(_Model):
    """A mesh file below the project's folder, in any format of meshio."""

    kind: Literal["file"]
    path: str
    scale: Positive = 1.0

    @field_validator("path")
    @classmethod
    def _inside(cls, value: str) -> str:
        if Path(value).is_absolute() or ".." in Path(value).parts:
            raise ValueError("a path below the project's folder is required, without '..'")
        return value

    def coarsened(self, factor: float) -> Self:
        """A mesh file has one resolution."""
        return self

    def build(self, root: Path) -> Mesh:
        """Read the mesh."""
        mesh = read_mesh_file(root / self.path)
        return Mesh(mesh.points * self.scale, mesh.triangles, mesh.tetrahedra)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return Path(self.path).stem


MeshConfig = Annotated[ClothMesh | BarMesh | MeshFile, Field(discriminator="kind")]
