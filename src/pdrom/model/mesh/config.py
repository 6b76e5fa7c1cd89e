"""Typed configuration of a mesh: a generator with its parameters, or a file."""

import logging
import re
from math import prod
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from pdrom.core.errors import MeshError
from pdrom.core.names import check_lengths
from pdrom.model.mesh.checks import check_mesh, check_range
from pdrom.model.mesh.files import read_mesh_file
from pdrom.model.mesh.generators import Plane, bar, cloth
from pdrom.model.mesh.given import GivenMesh
from pdrom.model.mesh.lengths import Length, PositiveLength
from pdrom.model.mesh.limits import MAX_VERTICES
from pdrom.model.mesh.mesh_model import MeshModel
from pdrom.model.mesh.orientation import turned_alike
from pdrom.model.mesh.types import Mesh

log = logging.getLogger(__name__)

Count = Annotated[int, Field(ge=2, le=2000)]


def _check_size(**counts: int) -> None:
    total = prod(counts.values())
    if total > MAX_VERTICES:
        product = " x ".join(f"{name} = {count}" for name, count in counts.items())
        raise ValueError(f"{product} are {total} vertices, allowed: at most {MAX_VERTICES}")


class ClothMesh(MeshModel):
    """Sheet of the generator `pdrom.model.mesh.generators.cloth`; lengths in metres."""

    kind: Literal["cloth"]
    rows: Count = 20
    columns: Count = 20
    plane: Plane = "xy"
    extent: PositiveLength = 1.0
    lift: Length = 2.0
    wave: Length = 0.0

    @model_validator(mode="after")
    def _not_too_large(self) -> Self:
        _check_size(rows=self.rows, columns=self.columns)
        return self

    def coarsened(self, factor: float) -> Self:
        """Same sheet with ``factor`` times the vertices along each side, at least 4."""
        sizes = {name: max(4, round(getattr(self, name) * factor)) for name in ("rows", "columns")}
        return self.model_copy(update=sizes)

    def build(self, root: Path) -> Mesh:
        """Generate the mesh; nothing is read below ``root``."""
        return cloth(
            self.rows, self.columns, self.plane, extent=self.extent, lift=self.lift, wave=self.wave
        )

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"cloth_{self.rows}x{self.columns}_{self.plane}"


class BarMesh(MeshModel):
    """Bar of the generator `pdrom.model.mesh.generators.bar`; lengths in metres."""

    kind: Literal["bar"]
    nx: Count = 40
    ny: Count = 5
    nz: Count = 5
    extent: PositiveLength = 1.0
    lift: Length = 2.0

    @model_validator(mode="after")
    def _not_too_large(self) -> Self:
        _check_size(nx=self.nx, ny=self.ny, nz=self.nz)
        return self

    def coarsened(self, factor: float) -> Self:
        """Same bar with ``factor`` times the vertices along each side, at least 3."""
        sizes = {name: max(3, round(getattr(self, name) * factor)) for name in ("nx", "ny", "nz")}
        return self.model_copy(update=sizes)

    def build(self, root: Path) -> Mesh:
        """Generate the mesh; nothing is read below ``root``."""
        return bar(self.nx, self.ny, self.nz, extent=self.extent, lift=self.lift)

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return f"bar_{self.nx}x{self.ny}x{self.nz}"


class MeshFile(MeshModel):
    """A mesh file below the project's folder, of a format that keeps it in one file."""

    kind: Literal["file"]
    path: str
    scale: Annotated[float, Field(ge=1e-9, le=1e9)] = 1.0

    @field_validator("path")
    @classmethod
    def _inside(cls, value: str) -> str:
        if Path(value).is_absolute() or ".." in Path(value).parts:
            raise ValueError("a path below the project's folder is required, without '..'")
        if not value.strip() or not value.isprintable():
            raise ValueError("a path of printable characters is required")
        check_lengths(value)
        return value

    def coarsened(self, factor: float) -> Self:
        """The mesh itself, whatever ``factor``: a mesh file has one resolution."""
        return self

    def build(self, root: Path) -> Mesh:
        """Read the mesh file below ``root``, all triangles turned the same way round.

        Raises
        ------
        MeshError, DegenerateElementError
            An unreadable or faulty file, see `read_mesh_file` and `check_mesh`, or a surface with
            one side only.
        """
        mesh = read_mesh_file(self.file(root))
        check_range(mesh.points, self.scale, self.path)
        scaled = Mesh(mesh.points * self.scale, mesh.triangles, mesh.tetrahedra)
        check_mesh(scaled, self.path)
        return scaled if len(scaled.tetrahedra) else self._turned(scaled)

    def _turned(self, mesh: Mesh) -> Mesh:
        turned = turned_alike(mesh.triangles, self.path)
        if not turned.any():
            return mesh
        log.warning(
            "%s: %d of %d triangles are listed the other way round than their neighbours, the "
            "first is %d: they are turned over",
            self.path, turned.sum(), len(turned), np.argmax(turned),
        )  # fmt: skip
        triangles = np.where(turned[:, None], mesh.triangles[:, ::-1], mesh.triangles)
        return Mesh(mesh.points, triangles)

    @property
    def sources(self) -> list[str]:
        """The mesh file."""
        return [self.path]

    def file(self, root: Path) -> Path:
        """The mesh file below ``root``; MeshError if a link leads out of the project's folder."""
        path = root / self.path
        try:
            inside = path.resolve().is_relative_to(root.resolve())
        except (OSError, RuntimeError) as error:  # a circle of links
            raise MeshError(f"mesh.path = '{self.path}': leads nowhere") from error
        if not inside:
            raise MeshError(f"mesh.path = '{self.path}': a link that leads out of the project")
        return path

    @property
    def label(self) -> str:
        """Readable part of the mesh's file name."""
        return re.sub(r"[^A-Za-z0-9_-]", "_", Path(self.path).stem)[:40]


MeshConfig = Annotated[
    ClothMesh | BarMesh | MeshFile | GivenMesh,
    Field(discriminator="kind"),
]
