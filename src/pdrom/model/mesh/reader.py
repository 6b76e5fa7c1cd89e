"""Reading of one mesh file in a separate process, started by `pdrom.model.mesh.files`.

A damaged file may take very long to read, or unpack to gigabytes; limits then end only this
process. Its arguments are the file and limits: seconds, bytes, numbers of vertices and of cells.
It writes points (N, 3) float64 and cells (E, 3 or 4) int64 as .npy and a remark, or, with the exit
status `REFUSED`, a sentence that states the fault.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from pdrom.model.mesh import grids, raw, surfaces

REFUSED = 3
NO_MEMORY = 4
READERS = {
    ".obj": surfaces.obj, ".stl": surfaces.stl, ".ply": surfaces.ply, ".off": surfaces.off,
    ".msh": grids.gmsh, ".mesh": grids.medit, ".vtk": grids.vtk, ".vtu": grids.vtu,
}  # fmt: skip
FACES = (raw.TRIANGLE, raw.POLYGON, raw.QUAD)
CORNERS = {raw.VERTEX: 1, raw.LINE: 2, raw.TRIANGLE: 3, raw.QUAD: 4, raw.TETRA: 4}
OTHERS = {6: "triangle strips", 12: "hexahedra", 13: "wedges", 14: "pyramids"}


def main(path: str, *numbers: str) -> int:
    """Write points and cells of the mesh file ``path`` to standard output; return the status."""
    seconds, memory, vertices, cells = map(int, numbers)
    _limit("RLIMIT_CPU", seconds)
    _limit("RLIMIT_AS", memory)
    _limit("RLIMIT_CORE", 0)
    try:
        *arrays, remark = read(path, vertices, cells)
        # np.save asks a file object for its position, which a pipe lacks
        pipe = SimpleNamespace(write=sys.stdout.buffer.write)
        for array in arrays:
            np.save(pipe, array, allow_pickle=False)
        sys.stdout.buffer.write(remark.encode())
        sys.stdout.flush()
    except MemoryError:
        os._exit(NO_MEMORY)  # end at once: a normal exit would need memory
    except raw.RefusedError as error:
        sys.stdout.buffer.write(str(error).encode())
        return REFUSED
    return 0


def _limit(name: str, value: int) -> None:
    """Lower the resource limit ``name`` of this process to ``value`` if the platform has it."""
    with suppress(ImportError, AttributeError, ValueError, OSError):
        import resource

        kind = getattr(resource, name)
        hard = resource.getrlimit(kind)[1]
        allowed = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (allowed, hard))


def read(path: str, max_vertices: int, max_cells: int) -> tuple[np.ndarray, np.ndarray, str]:
    """Return points (N, 3) float64 and cells (E, 3 or 4) int64 of the file ``path``, and a remark.

    Raises RefusedError, whose message states why, if the file is not a readable mesh.
    """
    suffix = Path(path).suffix.lower()
    content = Path(path).read_bytes().removeprefix(b"\xef\xbb\xbf")  # a byte order mark
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        content = content.decode("utf-16", errors="replace").encode()
    try:
        found = READERS[suffix](content)
        counts = ("vertices", found.points, max_vertices), ("cells", found.sizes, max_cells)
        for what, each, most in counts:
            if len(each) > most:
                raise raw.RefusedError(f"holds {len(each)} {what}, allowed: at most {most}")
        points = np.ascontiguousarray(found.points, np.float64)
        points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
        return points, *cells_of(found._replace(points=points))
    except (MemoryError, raw.RefusedError):
        raise
    except Exception as error:
        fault = f"truncated, or not a valid {suffix} file; `meshio convert` may read it"
        raise raw.UnreadableError(fault) from error


def cells_of(found: raw.Found) -> tuple[np.ndarray, str]:
    """Return tetrahedra (E, 4), or triangles (E, 3) if there are none, and a remark on polygons.

    Raises RefusedError for other cells, and for triangles that are no faces of the tetrahedra.
    """
    points, kinds, sizes, corners = found
    known = np.array([CORNERS.get(kind, -1) for kind in range(256)])[kinds]
    if ((known >= 0) & (sizes != known)).any() or (sizes < 1).any() or sizes.sum() != len(corners):
        raise raw.UnreadableError("cells with another number of corners than announced")
    others = sorted({*np.unique(kinds).tolist()} - {2, 4, *FACES, *CORNERS})
    if others:
        names = ", ".join(OTHERS.get(kind, f"cells of VTK's type {kind}") for kind in others)
        allowed = "triangles, polygons and linear tetrahedra"
        made = "which the filter Tetrahedralize of ParaView makes"
        raise raw.RefusedError(f"holds {names}; allowed are {allowed}, {made}")
    solid, flat = kinds == raw.TETRA, np.isin(kinds, FACES)
    if solid.any():
        tetrahedra = corners[np.repeat(solid, sizes)].reshape(-1, 4)
        _check_faces(corners[np.repeat(flat & (sizes == 3), sizes)].reshape(-1, 3), tetrahedra)
        return tetrahedra, ""
    sizes, corners = sizes[flat], corners[np.repeat(flat, sizes)]
    if not len(sizes):
        what = "only lines or points, which are not simulated" if len(kinds) else "no cells"
        required = "triangles or tetrahedra are required; gmsh makes them from a closed line"
        raise raw.RefusedError(f"holds {what}: {required} or surface")
    if sizes.min() < 3:
        raise raw.UnreadableError("faces of fewer than 3 corners")
    if sizes.max() == 3:
        return corners.reshape(-1, 3), ""
    if not ((corners >= 0) & (corners < len(points))).all():
        raise raw.UnreadableError(f"corners that are not among its {len(points)} vertices")
    starts, triangles, owners = np.cumsum(sizes) - sizes, [], []
    for size in np.unique(sizes):
        polygons = np.flatnonzero(sizes == size)
        triangles.append(split(points, corners[starts[polygons][:, None] + np.arange(size)]))
        owners.append(np.repeat(polygons, size - 2))
    order = np.argsort(np.concatenate(owners), kind="stable")
    count = np.count_nonzero(sizes > 3)
    remark = f"{count} of {len(sizes)} faces are polygons, split into triangles: {len(order)}"
    return np.concatenate(triangles)[order], remark


def split(points: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Return the triangles (m (n - 2), 3) of ``polygons`` (m, n), each split from one corner.

    Of the corners whose triangles all have the polygon's orientation, the first with the shortest
    diagonals is chosen. Raises RefusedError if a polygon is so concave that no corner is suitable.
    """
    count, size = polygons.shape
    if size == 3:
        return polygons
    place = points[polygons] - points[polygons[:, :1]]
    normal = np.cross(place, np.roll(place, -1, axis=1)).sum(axis=1, keepdims=True)
    shortest, best = np.full(count, np.inf), np.zeros(count, dtype=int)
    for corner in range(size):
        arms = np.roll(place, -corner, axis=1)[:, 1:] - place[:, [corner]]
        areas = (np.cross(arms[:, :-1], arms[:, 1:]) * normal).sum(axis=2)
        length = np.linalg.norm(arms[:, 1:-1], axis=2).sum(axis=1)
        better = (areas > 0.0).all(axis=1) & (length < (1.0 - 1e-9) * shortest)
        shortest[better], best[better] = length[better], corner
    if np.isinf(shortest).any():
        folded = polygons[np.isinf(shortest).argmax()].tolist()
        raise raw.RefusedError(
            f"holds a polygon, {folded[:10]}, that is too concave to be split or has a corner "
            "twice: triangulate it in Blender or MeshLab"
        )
    turned = polygons[np.arange(count)[:, None], (best[:, None] + np.arange(size)) % size]
    first = np.repeat(turned[:, :1], size - 2, axis=1)
    return np.stack([first, turned[:, 1:-1], turned[:, 2:]], axis=2).reshape(-1, 3)


def _check_faces(triangles: np.ndarray, tetrahedra: np.ndarray) -> None:
    """Raise RefusedError unless all ``triangles`` are faces of the ``tetrahedra``.

    Mesh generators often write the boundary faces as well, which follow from the tetrahedra.
    """
    faces = tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
    size = max(int(corners.max(initial=0)) for corners in (triangles, faces)) + 1

    # an integer per face; 64 bits suffice for 10^6 vertices
    weights = np.array([size**2, size, 1])
    if not np.isin(*(np.sort(corners, axis=1) @ weights for corners in (triangles, faces))).all():
        fault = "holds tetrahedra and triangles that are not their faces"
        raise raw.RefusedError(f"{fault}; only one of these kinds is allowed")
