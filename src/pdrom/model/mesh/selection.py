"""Selections of mesh vertices by name of a side, index, rest position or connected part."""

from abc import abstractmethod
from functools import reduce
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator
from scipy import sparse
from scipy.sparse import csgraph

from pdrom.core.errors import SceneError
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.mesh.types import Length, Mesh, PositiveLength, boundary_edges

Point = tuple[Length, Length, Length]
Index = Annotated[int, Field(ge=0, le=1_000_000)]


def require_ordered(box: Any) -> Any:
    """Return ``box``; ValueError if ``lower`` exceeds ``upper`` on an axis."""
    for axis, low, high in zip("xyz", box.lower, box.upper, strict=True):
        if low > high:
            raise ValueError(f"lower = {low:g} exceeds upper = {high:g} along {axis}")
    return box


def require_direction(plane: Any) -> Any:
    """Return ``plane``; ValueError if its ``normal`` is too short to define a direction."""
    if not np.linalg.norm(plane.normal) >= 1e-12:
        raise ValueError(f"normal = {list(plane.normal)}: too short for a direction")
    return plane


class Shape(ConfigModel):
    """Base class of selections by rest position, by connected part or by other selections."""

    @abstractmethod
    def chosen(self, mesh: Mesh) -> np.ndarray:
        """Return the indices (n,), ascending or empty, of the selected vertices of ``mesh``."""


class Box(Shape):
    """Vertices in or on the box with corners ``lower`` and ``upper`` (m)."""

    kind: Literal["box"] = "box"
    lower: Point
    upper: Point

    _ordered = model_validator(mode="after")(require_ordered)

    def chosen(self, mesh: Mesh) -> np.ndarray:
        slack = TOLERANCE * mesh.extent
        above = mesh.points >= np.array(self.lower) - slack
        return np.flatnonzero((above & (mesh.points <= np.array(self.upper) + slack)).all(axis=1))


class Sphere(Shape):
    """Vertices within ``radius`` of ``centre`` (m)."""

    kind: Literal["sphere"] = "sphere"
    centre: Point
    radius: PositiveLength

    def chosen(self, mesh: Mesh) -> np.ndarray:
        distance = np.linalg.norm(mesh.points - np.array(self.centre), axis=1)
        return np.flatnonzero(distance <= self.radius + TOLERANCE * mesh.extent)


class Plane(Shape):
    """Vertices on the plane through ``point`` (m) or on the side to which ``normal`` points."""

    kind: Literal["plane"] = "plane"
    point: Point
    normal: Point

    _directed = model_validator(mode="after")(require_direction)

    def chosen(self, mesh: Mesh) -> np.ndarray:
        normal = np.array(self.normal) / np.linalg.norm(self.normal)
        height = (mesh.points - np.array(self.point)) @ normal
        return np.flatnonzero(height >= -TOLERANCE * mesh.extent)


class Nearest(Shape):
    """The ``count`` vertices nearest to ``point`` (m); ties: the first vertices."""

    kind: Literal["nearest"] = "nearest"
    point: Point
    count: Annotated[int, Field(ge=1, le=1_000_000)] = 1

    def chosen(self, mesh: Mesh) -> np.ndarray:
        if self.count > mesh.vertices:
            raise SceneError(f"selection nearest: count = {self.count} of {mesh.vertices} vertices")
        distance = _distance(mesh.points, np.array(self.point))
        return np.sort(np.argsort(distance, kind="stable")[: self.count])


class BoundaryLoop(Shape):
    """Vertices of loop ``index`` of boundary edges; loop 0 is the longest at rest."""

    kind: Literal["boundary_loop"] = "boundary_loop"
    index: Index = 0

    def chosen(self, mesh: Mesh) -> np.ndarray:
        border = boundary_edges(mesh.triangles)
        lengths = np.linalg.norm(mesh.points[border[:, 0]] - mesh.points[border[:, 1]], axis=1)
        # each vertex gets half of the lengths of its edges; their sum over a loop is its length
        shares = np.bincount(border.ravel(), np.repeat(lengths / 2.0, 2), minlength=mesh.vertices)
        return _part(mesh, border, np.unique(border), shares, "boundary loop", self.index)


class Component(Shape):
    """Vertices of connected part ``index`` of the mesh; part 0 has the most vertices."""

    kind: Literal["component"] = "component"
    index: Index = 0

    def chosen(self, mesh: Mesh) -> np.ndarray:
        every = np.arange(mesh.vertices)
        return _part(mesh, mesh.edges(), every, np.ones(len(every)), "component", self.index)


class Union(Shape):
    """Vertices in at least one of the selections ``of``."""

    kind: Literal["union"] = "union"
    of: Annotated[tuple["Selection", ...], Field(min_length=1)]

    def chosen(self, mesh: Mesh) -> np.ndarray:
        return reduce(np.union1d, [_chosen(mesh, part) for part in self.of])


class Intersection(Shape):
    """Vertices in all of the selections ``of``."""

    kind: Literal["intersection"] = "intersection"
    of: Annotated[tuple["Selection", ...], Field(min_length=1)]

    def chosen(self, mesh: Mesh) -> np.ndarray:
        return reduce(np.intersect1d, [_chosen(mesh, part) for part in self.of])


class Complement(Shape):
    """Vertices that are not in the selection ``of``."""

    kind: Literal["complement"] = "complement"
    of: "Selection"

    def chosen(self, mesh: Mesh) -> np.ndarray:
        return np.setdiff1d(np.arange(mesh.vertices), _chosen(mesh, self.of))


KINDS = tuple(shape.model_fields["kind"].default for shape in Shape.__subclasses__())


def _tag(value: Any) -> str | None:
    """Return "side", "vertices" or one of `KINDS`: the kind of selection ``value``, or None."""
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


# side name -> (axis, +1 for the maximal side, -1 for the minimal one)
SIDES = {
    f"{axis}_{end}": (i, s) for i, axis in enumerate("xyz") for end, s in (("min", -1), ("max", 1))
}
# other names of these sides, in this order, for scenes in which y points up
WORDS = dict(zip(("left", "right", "bottom", "top", "back", "front"), SIDES.values(), strict=True))
TOLERANCE = 1e-6  # distance to a side up to which vertices belong to it, relative to the extent


def select_vertices(mesh: Mesh, selection: Selection) -> np.ndarray:
    """Return vertex indices (n,) int64, ascending, of a side, index list or `Shape`.

    SceneError if the selection is empty, an index out of range, or a side, boundary loop or
    component does not exist, or if the mesh is flat in the direction of a side.
    """
    chosen = _chosen(mesh, selection)
    if len(chosen) == 0:
        shown = list(selection) if isinstance(selection, tuple | list) else selection
        raise SceneError(f"selection {shown}: selects no vertex")
    return chosen.astype(np.int64)


def _chosen(mesh: Mesh, selection: Selection) -> np.ndarray:
    """Return the vertices that `select_vertices` returns; an empty selection is no error."""
    if isinstance(selection, str):
        return _side(mesh, selection)
    if isinstance(selection, Shape):
        return selection.chosen(mesh)
    outside = [index for index in selection if not 0 <= index < mesh.vertices]
    if outside:
        raise SceneError(f"selection: vertex {outside[0]} is not in 0 to {mesh.vertices - 1}")
    return np.unique(np.asarray(selection, dtype=np.int64))


def _side(mesh: Mesh, side: str) -> np.ndarray:
    known = SIDES | WORDS
    if side not in known:
        raise SceneError(f"selection '{side}': allowed are {', '.join(known)} or vertex indices")
    axis, sign = known[side]
    coordinate = sign * mesh.points[:, axis]
    if np.ptp(coordinate) <= TOLERANCE * mesh.extent:
        raise SceneError(f"selection '{side}': selects nothing, the mesh is flat along this axis")
    return np.flatnonzero(coordinate >= coordinate.max() - TOLERANCE * mesh.extent)


def _part(
    mesh: Mesh, edges: np.ndarray, among: np.ndarray, sizes: np.ndarray, what: str, index: int
) -> np.ndarray:
    """Return the vertices of component ``index`` of the graph of ``edges`` on vertices ``among``.

    Components are sorted by the sum of their ``sizes`` (N,), largest first; ties: smallest vertex.
    The SceneError for an ``index`` that is too large calls the component ``what``.
    """
    n = mesh.vertices
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    labels = csgraph.connected_components(graph, directed=False)[1][among]
    parts = [among[labels == label] for label in np.unique(labels)]
    # rounding makes sizes that are equal by symmetry equal on every machine
    parts.sort(key=lambda part: (-round(float(sizes[part].sum()) / mesh.extent, 9), part[0]))
    if index >= len(parts):
        raise SceneError(f"selection {what}: index = {index}, the mesh has {len(parts)}")
    return parts[index]


def farthest_points(points: np.ndarray, candidates: np.ndarray, count: int) -> np.ndarray:
    """Return ``count`` of the vertices ``candidates`` (n,) by farthest-point sampling.

    The first vertex is nearest to the centre of the bounding box of all ``points`` (N, 3) m, each
    further vertex is farthest from those already chosen. Ties: the first of ``candidates``.
    """
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    chosen = [int(candidates[np.argmin(_distance(points[candidates], centre))])]
    nearest = _distance(points[candidates], points[chosen[0]])
    while len(chosen) < count:
        chosen.append(int(candidates[np.argmax(nearest)]))
        nearest = np.minimum(nearest, _distance(points[candidates], points[chosen[-1]]))
    return np.array(chosen)


def _distance(points: np.ndarray, point: np.ndarray) -> np.ndarray:
    # rounding makes distances that are equal by symmetry equal on every machine
    return np.round(np.linalg.norm(points - point, axis=1), 12)
