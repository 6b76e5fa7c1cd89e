"""Shaded pictures of triangle meshes, drawn with matplotlib polygons.

Faces are painted from far to near (painter's algorithm) and lit from both sides (Lambert), so that
a sheet shows its folds whichever side it turns to the camera.
"""

import numpy as np

from pdrom.model.mesh.types import Mesh
from pdrom.view.artists import Axes, PolyCollection
from pdrom.view.camera import Camera, Window

AMBIENT = 0.45  # least brightness of a face
RASTER_ABOVE = 1000  # surfaces with more faces are rasterised, to keep the PDF small
SHARP = np.cos(np.radians(80.0))  # an edge is outlined if normals of its faces differ by more
# lights: (direction towards the light in camera coordinates, strength)
LIGHTS = (((-0.35, 0.45, 0.82), 0.85), ((0.80, -0.10, 0.59), 0.30))
BACK = 0.78  # factor that darkens the back of an open surface
FLOOR, FLOOR_LINE, SHADOW = "#F4F2EE", "#DEDAD2", "#D3CFC6"
GHOST = "#4D4D4D"  # colour of the outline of a reference shape

Colour = str | tuple[float, float, float]


def face_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return unit normals (T, 3) of ``triangles`` of ``points`` (N, 3); zero for zero area."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return _unit(np.cross(b - a, c - a))


def smooth_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return unit normals (T, 3) as `face_normals`, but averaged over neighbouring faces."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    weighted = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    vertex = np.zeros_like(points, dtype=float)
    np.add.at(vertex, triangles.ravel(), weighted)
    return _unit(_unit(vertex)[triangles].sum(axis=1))


def shade(normals: np.ndarray, camera: Camera) -> np.ndarray:
    """Return the brightness (T,), in [AMBIENT, 1], of faces with unit ``normals`` (T, 3)."""
    view = normals @ camera.basis.T
    lit = np.zeros(len(normals))
    for direction, strength in LIGHTS:
        unit = np.asarray(direction) / np.linalg.norm(direction)
        lit += strength * np.abs(view @ unit)
    return AMBIENT + (1.0 - AMBIENT) * np.clip(lit, 0.0, 1.0)


def draw_surface(
    ax: Axes,
    points: np.ndarray,
    mesh: Mesh,
    camera: Camera,
    colour: Colour | np.ndarray,
    wire: float = 0.14,
    contrast: float = 1.0,
) -> PolyCollection:
    """Draw the shaded surface of ``mesh`` on ``ax``, as ``camera`` sees it.

    The surface of a volume is closed; an open surface is shaded smoothly, its back darker.

    points : (N, 3) m, finite, positions of the vertices
    colour : one colour, or one RGB row per face (T, 3)
    wire : opacity of the wireframe, 0 for none
    contrast : 1 for the full shading; smaller where colours represent numbers
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    triangles, is_open = mesh.triangles, len(mesh.tetrahedra) == 0
    raw = face_normals(points, triangles)
    normals = smooth_normals(points, triangles) if is_open else raw
    brightness = 1.0 - contrast * (1.0 - shade(normals, camera))
    base = colour if isinstance(colour, np.ndarray) else np.tile(to_rgb(colour), (len(raw), 1))
    if is_open and contrast == 1.0:
        back = raw @ camera.basis[2] < 0.0
        base = np.where(back[:, None], BACK * base + (1.0 - BACK) * 0.55, base)
    faces = np.clip(base * brightness[:, None], 0.0, 1.0)
    edges = (1.0 - wire) * faces + wire * 0.08
    order = np.argsort(camera.depth(points)[triangles].mean(axis=1), kind="stable")
    collection = PolyCollection(
        camera.project(points)[triangles[order]], facecolors=faces[order], linewidths=0.2,
        edgecolors=edges[order], joinstyle="round", rasterized=len(triangles) > RASTER_ABOVE,
    )  # fmt: skip
    ax.add_collection(collection)
    return collection


def draw_floor(ax: Axes, points: np.ndarray, mesh: Mesh, camera: Camera, window: Window) -> None:
    """Draw the floor y = 0, if in view, with the shadow of ``mesh`` at ``points`` (N, 3) m."""
    from matplotlib.collections import PolyCollection

    margin = 0.25 * max(window.width, window.height)
    near = camera.project(points * [1.0, 0.0, 1.0])
    if camera.elevation < 3.0 or not window.contains(near).any():
        return
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    (west, _, south), (east, _, north) = low, high
    corners = np.array([[west, 0, south], [east, 0, south], [east, 0, north], [west, 0, north]])
    floor = {"facecolors": FLOOR, "edgecolors": FLOOR_LINE, "linewidths": 0.5, "zorder": 0.1}
    ax.add_collection(PolyCollection([camera.project(corners)], **floor))
    shadow = {"facecolors": SHADOW, "edgecolors": SHADOW, "linewidths": 0.25, "zorder": 0.2}
    raster = len(mesh.triangles) > RASTER_ABOVE
    ax.add_collection(PolyCollection(near[mesh.triangles], rasterized=raster, **shadow))


def outline_edges(
    rest: np.ndarray, points: np.ndarray, triangles: np.ndarray, camera: Camera
) -> np.ndarray:
    """Return edges (n, 2) on the surface's boundary, or between faces that meet sharply at rest.

    A round body has no such edges: its silhouette edges are returned, between a face turned to the
    ``camera`` and one turned away. ``rest`` and ``points`` are (N, 3) m, ``triangles`` (T, 3).
    """
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    edges, inverse, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    owner = owner[np.argsort(inverse.ravel(), kind="stable")]
    start = np.concatenate([[0], np.cumsum(count)[:-1]])
    # indices of the two triangles at each edge; at a boundary edge both are the same triangle
    first, second = owner[start], owner[start + np.minimum(count - 1, 1)]
    normals = face_normals(rest, triangles)
    turn = np.einsum("ij,ij->i", normals[first], normals[second])
    own = edges[(first == second) | (turn < SHARP)]
    if len(own):
        return own
    a, b, c = np.moveaxis(camera.project(points)[triangles], 1, 0)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    front = ux * vy > uy * vx
    return edges[front[first] != front[second]]


def set_window(ax: Axes, window: Window) -> None:
    """Show ``window`` on ``ax`` without axes, all directions to the same scale."""
    ax.set(xlim=(window.left, window.right), ylim=(window.bottom, window.top), aspect="equal")
    ax.set(xticks=[], yticks=[])
    for spine in ax.spines.values():
        spine.set_visible(False)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors, dtype=float), where=length > 0.0)
