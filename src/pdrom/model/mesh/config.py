"""Typed configuration of meshes: a generator with parameters, a file, or arrays."""

import hashlib
import json
import logging
import re
from abc import ABC, abstractmethod
from math import prod
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from pdrom.core.errors import MeshError
from pdrom.core.yamlfile import ConfigModel, check_lengths
from pdrom.model.mesh import checks
from pdrom.model.mesh.files import MAX_VERTICES, read_mesh_file
from pdrom.model.mesh.generators import Plane, bar, cloth
from pdrom.model.mesh.types import Length, Mesh, PositiveLength

log = logging.getLogger(__name__)


class MeshModel(ConfigModel):
    """Base class of the configurations of a mesh."""

    @property
    def label(self) -> str:
        """Readable name of the mesh for messages and file names."""
        raise NotImplementedError(f"{type(self).__name__} has no label")

    @property
    def identifier(self) -> str:
        """File name of the mesh: its label and a checksum of all parameters."""
        canonical = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return f"{self.label}_{hashlib.sha256(canonical.encode()).hexdigest()[:8]}"

    @property
    def sources(self) -> list[str]:
        """Paths of the files from which the mesh is read; empty for a generated mesh."""
        return []

    def coarsened(self, factor: float) -> Self:
        """Return the mesh unchanged: files and given arrays have a single resolution."""
        return self


_DIGITS = 32  # number of hexadecimal digits of a digest
Count = Annotated[int, Field(ge=2, le=2000)]


class GeneratedMesh(MeshModel, ABC):
    """Mesh of a regular grid; `sides` are the keys with the numbers of vertices along its sides."""

    sides: ClassVar[tuple[str, ...]]
    least: ClassVar[int]
    """Smallest number of vertices along a side of a coarsened mesh."""

    @property
    def axes(self) -> list[int]:
        """Axes along which the sides of the grid lie (0: x), in any order."""
        return [0, 1, 2]

    @abstractmethod
    def build(self, root: Path) -> Mesh:
        """Return the mesh; ``root`` is ignored."""

    @model_validator(mode="after")
    def _not_too_large(self) -> Self:
        counts = self.model_dump(include=set(self.sides))
        total = prod(counts.values())
        if total > MAX_VERTICES:
            product = " x ".join(f"{name} = {count}" for name, count in counts.items())
            raise ValueError(f"{product} are {total} vertices, allowed: at most {MAX_VERTICES}")
        return self

    def coarsened(self, factor: float) -> Self:
        """Return the mesh with ``factor`` times the vertices along each side, at least `least`."""
        sizes = {name: max(self.least, round(getattr(self, name) * factor)) for name in self.sides}
        return self.model_copy(update=sizes)

    def with_cells(self, part: float) -> Mesh:
        """Build the mesh with ``part`` of its cells along each side, stretched to the same size."""
        counts = {name: 1 + round(part * (getattr(self, name) - 1)) for name in self.sides}
        least = {name: max(self.least, count) for name, count in counts.items()}
        own, coarse = (one.build(Path()) for one in (self, self.model_copy(update=least)))
        points = coarse.points.copy()
        for axis in self.axes:
            low, high = own.points[:, axis].min(), own.points[:, axis].max()
            x = points[:, axis]
            points[:, axis] = low + (x - x.min()) * ((high - low) / (x.max() - x.min()))
        return Mesh(points, coarse.triangles, coarse.tetrahedra)


class ClothMesh(GeneratedMesh):
    """Sheet of the generator `pdrom.model.mesh.generators.cloth`; lengths in metres."""

    sides = ("rows", "columns")
    least = 4

    kind: Literal["cloth"]
    rows: Count = 20
    columns: Count = 20
    plane: Plane = "xy"
    extent: PositiveLength = 1.0
    lift: Length = 2.0
    wave: Length = 0.0

    def build(self, root: Path) -> Mesh:
        return cloth(
            self.rows, self.columns, self.plane, extent=self.extent, lift=self.lift, wave=self.wave
        )

    @property
    def axes(self) -> list[int]:
        return [0, 1] if self.plane == "xy" else [0, 2]

    @property
    def label(self) -> str:
        return f"cloth_{self.rows}x{self.columns}_{self.plane}"


class BarMesh(GeneratedMesh):
    """Bar of the generator `pdrom.model.mesh.generators.bar`; lengths in metres."""

    sides = ("nx", "ny", "nz")
    least = 3

    kind: Literal["bar"]
    nx: Count = 40
    ny: Count = 5
    nz: Count = 5
    extent: PositiveLength = 1.0
    lift: Length = 2.0

    def build(self, root: Path) -> Mesh:
        return bar(self.nx, self.ny, self.nz, extent=self.extent, lift=self.lift)

    @property
    def label(self) -> str:
        return f"bar_{self.nx}x{self.ny}x{self.nz}"


class MeshFile(MeshModel):
    """A mesh file in the scene file's folder or below; formats with several files are excluded.

    path : path of the mesh file, relative to the folder of the scene file
    merge : vertices that are closer than this fraction of the extent become one; if it is set,
        vertices in no element are left out
    """

    kind: Literal["file"]
    path: str
    scale: Annotated[float, Field(ge=1e-9, le=1e9)] = 1.0
    merge: Annotated[float, Field(ge=0.0, le=0.01)] = 0.0

    @model_serializer(mode="wrap")
    def _without_default(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave ``merge`` out if it is 0, so that identifiers stay those of earlier versions."""
        return {key: value for key, value in write(self).items() if key != "merge" or value}

    @field_validator("path")
    @classmethod
    def _inside(cls, value: str) -> str:
        if Path(value).is_absolute() or ".." in Path(value).parts:
            raise ValueError("a path below the folder of the scene is required, without '..'")
        if not value.strip() or not value.isprintable():
            raise ValueError("a path of printable characters is required")
        check_lengths(value)
        return value

    def below(self, folder: str) -> Self:
        """Return the mesh with the scene's ``folder`` put in front of its path."""
        return self.model_copy(update={"path": f"{folder}/{self.path}"})

    def build(self, root: Path) -> Mesh:
        """Return the mesh of the file in the folder ``root``, with consistently oriented triangles.

        MeshError if the file is unreadable, see `read_mesh_file`, the mesh faulty, see
        `check_mesh`, or a surface not orientable.
        """
        mesh = read_mesh_file(self.file(root))
        checks.check_range(mesh.points, self.scale, self.path)
        scaled = Mesh(mesh.points * self.scale, mesh.triangles, mesh.tetrahedra)
        if self.merge:
            scaled = checks.merged(scaled, self.merge * scaled.extent, self.path)
        checks.check_mesh(scaled, self.path)
        if "pairs" in (found := checks.seams(scaled)):
            advice = f"`merge: {checks.SEAM:.1e}` below `mesh` merges them"
            log.warning("%s: %s; %s", self.path, found, advice)
        if len(scaled.tetrahedra):
            return scaled
        alike, turned = checks.turned_alike(scaled, self.path)
        if len(turned):
            log.warning(
                "%s: %d of %d triangles have the opposite orientation of their neighbours, the "
                "first is %d: they are reversed",
                self.path, len(turned), len(alike.triangles), turned[0],
            )  # fmt: skip
        return alike

    @property
    def sources(self) -> list[str]:
        return [self.path]

    def file(self, root: Path) -> Path:
        """Return the path of the file in ``root``; MeshError if a link leads out of ``root``."""
        path = root / self.path
        try:
            inside = path.resolve().is_relative_to(root.resolve())
        except (OSError, RuntimeError) as error:  # raised for a cycle of symbolic links
            raise MeshError(f"mesh.path = '{self.path}': leads to no file") from error
        if not inside:
            raise MeshError(f"mesh.path = '{self.path}': a link that leads out of {root.resolve()}")
        return path

    @property
    def label(self) -> str:
        return re.sub(r"[^A-Za-z0-9_-]", "_", Path(self.path).stem)[:40]


class GivenMesh(MeshModel):
    """Mesh given as arrays from Python; files of runs store these arrays with the configuration.

    blake2b : digest of the arrays, by which configurations of different meshes differ
    """

    kind: Literal["given"]
    blake2b: Annotated[str, Field(pattern=rf"^[0-9a-f]{{{_DIGITS}}}$")]

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """Return the configuration of a ``mesh`` that was given as arrays."""
        digest = hashlib.blake2b(digest_size=_DIGITS // 2)
        for array in (mesh.points, mesh.triangles, mesh.tetrahedra):
            digest.update(f"{array.shape}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return cls(kind="given", blake2b=digest.hexdigest())

    def build(self, root: Path) -> Mesh:
        """Raise MeshError: the configuration has a digest of the mesh's arrays, not the arrays."""
        raise MeshError("mesh.kind = 'given': pass its arrays from Python (pdrom.api.build_scene)")

    @property
    def label(self) -> str:
        return "given"


def given_mesh(points: Any, cells: Any, name: str) -> Mesh:
    """Return the mesh of points (N, 3) m and cells; error messages begin with ``name``.

    Cells are triangles (T, 3), which are oriented consistently, or tetrahedra (E, 4), with positive
    volume, as vertex indices from 0. MeshError if an array has a wrong shape or type, an index is
    out of range, or a surface not orientable; the rest is checked when a scene is built.
    """
    points = _array(points, f"{name}: points", np.float64, (3,))
    cells = _array(cells, f"{name}: cells", np.int64, (3, 4))
    if not len(points) or not len(cells):
        raise MeshError(f"{name}: {len(points)} points and {len(cells)} cells, both are required")
    checks.check_range(points, 1.0, name)
    mesh = checks.mesh_of(points, cells, name)
    return mesh if len(mesh.tetrahedra) else checks.turned_alike(mesh, name)[0]


def _array(values: Any, name: str, kind: type[np.generic], widths: tuple[int, ...]) -> np.ndarray:
    """Return ``values`` (n, one of ``widths``) as a new array of ``kind``, or raise MeshError."""
    required = " or ".join(f"(n, {width})" for width in widths)
    try:
        array = np.array(values)
        if array.ndim != 2 or array.shape[1] not in widths:
            raise MeshError(f"{name} of shape {array.shape}, required: {required}")
        return np.ascontiguousarray(array.astype(kind, casting="same_kind"))
    except (TypeError, ValueError) as error:
        fault = " ".join(str(error).split())
        raise MeshError(f"{name}: an array {required} is required ({fault})") from error


MeshConfig = Annotated[ClothMesh | BarMesh | MeshFile | GivenMesh, Field(discriminator="kind")]
