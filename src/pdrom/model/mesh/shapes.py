"""Unstructured meshes: a disc with a hole, closed surfaces, and the bodies that they enclose.

A closed surface is triangulated in the plane and mapped to space by a map that keeps angles; what
its image has too large is refined (`pdrom.model.mesh.mesher`). A ball is two discs, each projected
stereographically on one half; a starfish is a ball whose radius depends on the direction; a torus
is a rectangle with opposite sides joined, the stereographic image of Clifford's torus.
"""

from collections.abc import Callable

import numpy as np

from pdrom.model.mesh.generators import Plane, boundary, orient
from pdrom.model.mesh.mesher import fill, triangulate
from pdrom.model.mesh.types import Mesh

Map = Callable[[np.ndarray], np.ndarray]
Surface = tuple[np.ndarray, np.ndarray]

# radius of the torus's tube over that of its centre line
TUBE = 0.4
# where the rim of the second half of a ball begins: the halves are no mirror images
TURNED = 3
FEWEST = 8  # points of a closed line


def disc(edge: float, hole: float, plane: Plane, extent: float, lift: float) -> Mesh:
    """Disc of diameter ``extent`` with a round hole in the middle; lengths in metres.

    Parameters
    ----------
    edge : length of an edge, about
    hole : diameter of the hole over that of the disc; 0: none
    plane, lift : as for `pdrom.model.mesh.generators.cloth`
    """
    rims = [_circle(radius, edge / extent) for radius in (0.5, 0.5 * hole) if radius > 0.0]
    segments = [_loop(len(rims[0])), *(_loop(len(rim), len(rims[0])) for rim in rims[1:])]
    middle = np.zeros(2) if hole > 0.0 else None
    uv, triangles = triangulate(
        np.concatenate(rims), np.concatenate(segments), middle, edge=edge / extent
    )
    u, v = extent * uv.T
    points = np.column_stack((u, v, 0.0 * u) if plane == "xy" else (u, 0.0 * u, v))
    points[:, 1] += lift
    return Mesh(points, triangles)


def shell(shape: str, edge: float, extent: float, lift: float) -> Mesh:
    """Closed surface ``shape`` (a key of `SURFACES`), oriented outwards.

    Parameters
    ----------
    edge, extent, lift : length of edges, longest side, height above the ground, m
    """
    points, triangles = SURFACES[shape](edge / extent)
    return Mesh(_placed(points, extent, lift), triangles)


def solid(shape: str, edge: float, extent: float, lift: float) -> Mesh:
    """Tetrahedra inside the closed surface ``shape``; ``edge``, ``extent``, ``lift`` as `shell`."""
    surface, triangles = SURFACES[shape](edge / extent)
    points, tetrahedra = fill(surface, triangles, edge / extent)
    tetrahedra = orient(points, tetrahedra)
    return Mesh(_placed(points, extent, lift), boundary(tetrahedra), tetrahedra)


def _placed(points: np.ndarray, extent: float, lift: float) -> np.ndarray:
    """Points about the origin whose longest side measures ``extent``, lifted along y."""
    low, high = points.min(axis=0), points.max(axis=0)
    placed = (points - 0.5 * (low + high)) * (extent / (high - low).max())
    placed[:, 1] += lift
    return placed


def _ball(edge: float) -> Surface:
    return _deformed(lambda sphere: 0.5 * sphere, edge)


def _deformed(shape: Map, edge: float) -> Surface:
    """Image of the unit sphere under ``shape``."""

    def half(side: int) -> Map:
        def image(uv: np.ndarray) -> np.ndarray:
            square = np.einsum("ij,ij->i", uv, uv)
            sphere = np.column_stack([2.0 * uv[:, 0], side * (1.0 - square), 2.0 * uv[:, 1]])
            return shape(sphere / (1.0 + square)[:, None])

        return image

    upper, lower = half(1), half(-1)
    rim = _on_circle(_spaced(lambda t: upper(_on_circle(t)), edge))
    n, segments = len(rim), _loop(len(rim))
    top, above = triangulate(rim, segments, None, edge=edge, image=upper)
    turned = np.roll(rim, -TURNED, axis=0)
    bottom, below = triangulate(turned, segments, None, edge=edge, image=lower)
    shared = (np.arange(n) + TURNED) % n
    number = np.concatenate([shared, len(top) + np.arange(len(bottom) - n)]).astype(np.int32)
    points = np.concatenate([upper(top), lower(bottom[n:])])
    return points, np.concatenate([above[:, ::-1], number[below]])


def _starfish(edge: float) -> Surface:
    return _deformed(_with_arms, edge)


def _with_arms(sphere: np.ndarray) -> np.ndarray:
    """Five arms in the plane x-z, flattened along y."""
    across = np.hypot(sphere[:, 0], sphere[:, 2])
    angle = np.arctan2(sphere[:, 2], sphere[:, 0])
    radius = 0.2 + 0.3 * across**4 * np.exp(np.cos(5.0 * angle) - 1.0)
    return radius[:, None] * sphere * [1.0, 0.5, 1.0]


def _torus(edge: float) -> Surface:
    tilt = np.arcsin(TUBE)
    c, s = np.cos(tilt), np.sin(tilt)
    width, height = 2.0 * np.pi * c, 2.0 * np.pi * s
    outer = (1.0 + s) / c  # radius, of which half is wanted

    def image(uv: np.ndarray) -> np.ndarray:
        along, around = uv[:, 0] / c, uv[:, 1] / s
        ring = np.column_stack([c * np.cos(along), s * np.cos(around), c * np.sin(along)])
        return 0.5 / outer * ring / (1.0 - s * np.sin(around))[:, None]

    u = width * _spaced(lambda t: image(np.column_stack([width * t, 0.0 * t])), edge)
    v = height * _spaced(lambda t: image(np.column_stack([0.0 * t, height * t])), edge)
    # the sides of the rectangle, anticlockwise; each begins with a corner
    sides = [
        np.column_stack([u, 0.0 * u]),
        np.column_stack([width + 0.0 * v, v]),
        np.column_stack([np.append(width, u[:0:-1]), height + 0.0 * u]),
        np.column_stack([0.0 * v, np.append(height, v[:0:-1])]),
    ]
    rim = np.round(np.concatenate(sides), 12)
    uv, triangles = triangulate(rim, _loop(len(rim)), None, edge=edge, image=image)
    # vertices of the right and the upper side are those opposite, all corners are the first one
    n, m = len(u), len(v)
    same = np.arange(len(uv))
    same[n : n + m] = (-np.arange(m)) % len(rim)
    same[n + m : 2 * n + m] = (n - np.arange(n)) % n
    same[[n, n + m, 2 * n + m]] = 0
    kept, joined = np.unique(same[triangles], return_inverse=True)
    return image(uv[kept]), joined.reshape(-1, 3).astype(np.int32)


def _circle(radius: float, edge: float) -> np.ndarray:
    """Points (n, 2) of a circle, anticlockwise and at equal distances."""
    n = max(FEWEST, round(2.0 * np.pi * radius / edge))
    return radius * _on_circle(np.arange(n) / n)


def _on_circle(t: np.ndarray) -> np.ndarray:
    """Points (n, 2) of the unit circle after the fractions t (n,) of a turn.

    Rounded, so that a mesh is the same on every machine.
    """
    return np.round(np.column_stack([np.cos(2.0 * np.pi * t), np.sin(2.0 * np.pi * t)]), 12)


def _spaced(curve: Map, edge: float) -> np.ndarray:
    """Parameters (n,) from 0 on of points that cut a closed curve on [0, 1] in equal lengths."""
    t = np.linspace(0.0, 1.0, 4001)
    steps = np.linalg.norm(np.diff(curve(t), axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    n = max(FEWEST, round(length[-1] / edge))
    return np.interp(length[-1] * np.arange(n) / n, length, t)


def _loop(count: int, first: int = 0) -> np.ndarray:
    """Segments (n, 2) of a closed line through ``count`` points from number ``first`` on."""
    number = np.arange(count)
    return first + np.column_stack([number, (number + 1) % count])


SURFACES: dict[str, Callable[[float], Surface]] = {
    "ball": _ball,
    "torus": _torus,
    "starfish": _starfish,
}
