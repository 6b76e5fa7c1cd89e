"""Generated meshes of any resolution: cloth of triangles, bar of tetrahedra (docs/study.md)."""

from typing import Literal

import numpy as np

from pdrom.model.mesh.types import Mesh

Plane = Literal["xy", "xz"]


def cloth(
    rows: int,
    columns: int,
    plane: Plane = "xy",
    extent: float = 1.0,
    lift: float = 2.0,
    wave: float = 0.0,
) -> Mesh:
    """Return a sheet of ``rows`` x ``columns`` vertices; square cells with two triangles each.

    Vertex (i, j) has index ``i * columns + j``. A cell with corners ll (lower left), ul = ll + 1,
    lr = ll + columns and ur = lr + 1 is split into [ll, ur, ul] and [ll, lr, ur]. The sheet is
    centred, its longer side measures ``extent`` metres, and it is lifted by ``lift`` m along y.

    plane : "xy" (upright) or "xz" (horizontal)
    wave : amplitude in metres of the displacement ``wave * sin(6 u) cos(5 v)`` normal to the plane,
        where u and v are the coordinates in the sheet divided by ``extent``
    """
    spacing = extent / (max(rows, columns) - 1)
    u = (np.arange(rows) - 0.5 * (rows - 1)) * spacing
    v = (np.arange(columns) - 0.5 * (columns - 1)) * spacing
    grid_u, grid_v = (a.ravel() for a in np.meshgrid(u, v, indexing="ij"))
    if wave:
        height = wave * np.sin(6.0 * grid_u / extent) * np.cos(5.0 * grid_v / extent)
    else:
        height = np.zeros_like(grid_u)
    order = (grid_u, grid_v, height) if plane == "xy" else (grid_u, height, grid_v)
    points = np.column_stack(order)
    points[:, 1] += lift
    i, j = (a.ravel() for a in np.meshgrid(range(rows - 1), range(columns - 1), indexing="ij"))
    ll = i * columns + j
    ul, lr, ur = ll + 1, ll + columns, ll + columns + 1
    pairs = np.stack([np.stack([ll, ur, ul], 1), np.stack([ll, lr, ur], 1)], axis=1)
    return Mesh(points, pairs.reshape(-1, 3).astype(np.int32))


# Five tetrahedra of a cell (i, j, k), the inner one first, if i + j + k is even; _ODD: if odd.
# Corner 4 di + 2 dj + dk of the cell is the vertex (i + di, j + dj, k + dk).
_EVEN = ((0, 3, 5, 6), (1, 0, 3, 5), (2, 0, 6, 3), (4, 0, 5, 6), (7, 3, 6, 5))
_ODD = ((1, 2, 4, 7), (0, 1, 2, 4), (3, 1, 7, 2), (5, 1, 4, 7), (6, 2, 7, 4))


def bar(nx: int, ny: int, nz: int, extent: float = 1.0, lift: float = 2.0) -> Mesh:
    """Return a bar of nx x ny x nz vertices with cubic cells of five tetrahedra each.

    Vertex (i, j, k) has index ``(i * ny + j) * nz + k``. Neighbouring cells are mirror images, so
    that face diagonals match. The bar is centred, its longest side is ``extent`` metres.

    lift : translation along y, m
    """
    counts = np.array([nx, ny, nz])
    spacing = extent / (counts.max() - 1)
    axes = [(np.arange(n) - 0.5 * (n - 1)) * spacing for n in counts]
    points = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    points[:, 1] += lift
    cells = np.indices((nx - 1, ny - 1, nz - 1)).reshape(3, -1).T
    shifts = np.array([[b >> 2 & 1, b >> 1 & 1, b & 1] for b in range(8)])
    corners = cells[:, None, :] + shifts
    index = (corners[..., 0] * ny + corners[..., 1]) * nz + corners[..., 2]
    odd = cells.sum(axis=1) % 2 == 1
    pattern = np.where(odd[:, None, None], np.array(_ODD), np.array(_EVEN))
    found = np.take_along_axis(index[:, None, :].repeat(5, axis=1), pattern, axis=2)
    tetrahedra = orient(points, found.reshape(-1, 4))
    return Mesh(points, boundary(tetrahedra), tetrahedra)


def orient(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Return ``tetrahedra`` (E, 4), int32, corners reordered so that their volumes are positive."""
    a, b, c, d = (points[tetrahedra[:, i]] for i in range(4))
    negative = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    oriented = tetrahedra.astype(np.int32)
    oriented[negative, 2], oriented[negative, 3] = tetrahedra[negative, 3], tetrahedra[negative, 2]
    return oriented


def boundary(tetrahedra: np.ndarray) -> np.ndarray:
    """Return boundary faces (T, 3) int32 of ``tetrahedra`` (E, 4), oriented outwards."""
    faces = tetrahedra[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    ordered = np.sort(faces, axis=1).astype(np.int64)
    size = int(faces.max()) + 1
    # one 64-bit integer per face, enough for a million vertices, is faster to sort than rows
    keys = (ordered[:, 0] * size + ordered[:, 1]) * size + ordered[:, 2]
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])].astype(np.int32)
