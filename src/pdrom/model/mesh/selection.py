"""Typed selections of vertices, as the configuration names them; `select` finds the vertices."""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.mesh.lengths import Length, PositiveLength

Point = tuple[Length, Length, Length]
Index = Annotated[int, Field(ge=0, le=1_000_000)]


class Box(ConfigModel):
    """Vertices in the box from ``lower`` to ``upper`` (m), its surface included."""

    kind: Literal["box"] = "box"
    lower: Point
    upper: Point

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        return require_ordered(self)


class Sphere(ConfigModel):
    """Vertices within ``radius`` of ``centre`` (m)."""

    kind: Literal["sphere"] = "sphere"
    centre: Point
    radius: PositiveLength


class Plane(ConfigModel):
    """Vertices on the plane through ``point`` (m) and on the side that ``normal`` points to."""

    kind: Literal["plane"] = "plane"
    point: Point
    normal: Point

    @model_validator(mode="after")
    def _directed(self) -> Self:
        return require_direction(self)


class Nearest(ConfigModel):
    """The ``count`` vertices nearest to ``point`` (m); of equally near ones the first."""

    kind: Literal["nearest"] = "nearest"
    point: Point
    count: Annotated[int, Field(ge=1, le=1_000_000)] = 1


class BoundaryLoop(ConfigModel):
    """Vertices of a closed line of boundary edges; loop 0 is the longest at rest."""

    kind: Literal["boundary_loop"] = "boundary_loop"
    index: Index = 0


class Component(ConfigModel):
    """Vertices of a connected part of the mesh; part 0 has the most vertices."""

    kind: Literal["component"] = "component"
    index: Index = 0


class Union(ConfigModel):
    """Vertices in any of the selections ``of``."""

    kind: Literal["union"] = "union"
    of: Annotated[tuple["Selection", ...], Field(min_length=1)]


class Intersection(ConfigModel):
    """Vertices in all of the selections ``of``."""

    kind: Literal["intersection"] = "intersection"
    of: Annotated[tuple["Selection", ...], Field(min_length=1)]


class Complement(ConfigModel):
    """Vertices that are not in the selection ``of``."""

    kind: Literal["complement"] = "complement"
    of: "Selection"


KINDS = (
    "box", "sphere", "plane", "nearest", "boundary_loop", "component", "union", "intersection",
    "complement",
)  # fmt: skip


def _tag(value: Any) -> str | None:
    """Form of a selection that ``value`` has; None if it has none."""
    if isinstance(value, str):
        return "side"
    if isinstance(value, (list, tuple)):
        return "vertices"
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    return kind if kind in KINDS else None


Selection = Annotated[
    Annotated[str, Tag("side")]
    | Annotated[tuple[int, ...], Tag("vertices")]
    | Annotated[Box, Tag("box")]
    | Annotated[Sphere, Tag("sphere")]
    | Annotated[Plane, Tag("plane")]
    | Annotated[Nearest, Tag("nearest")]
    | Annotated[BoundaryLoop, Tag("boundary_loop")]
    | Annotated[Component, Tag("component")]
    | Annotated[Union, Tag("union")]
    | Annotated[Intersection, Tag("intersection")]
    | Annotated[Complement, Tag("complement")],
    Discriminator(
        _tag,
        custom_error_type="no_selection",
        custom_error_message="a side, a list of vertices, or a mapping whose kind is one of "
        + ", ".join(KINDS),
    ),
]

for _combination in (Union, Intersection, Complement):
    _combination.model_rebuild()


def require_ordered(box: Any) -> Any:
    """``box``; ValueError if its ``lower`` corner is not below its ``upper`` one on every axis."""
    for axis, low, high in zip("xyz", box.lower, box.upper, strict=True):
        if low > high:
            raise ValueError(f"lower = {low:g} exceeds upper = {high:g} along {axis}")
    return box


def require_direction(plane: Any) -> Any:
    """``plane``; ValueError if its ``normal`` is too short to have a direction."""
    if not np.linalg.norm(plane.normal) >= 1e-12:
        raise ValueError(f"normal = {list(plane.normal)}: has no direction")
    return plane
