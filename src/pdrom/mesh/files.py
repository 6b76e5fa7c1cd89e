"""Mesh files, read by meshio."""

import io
from contextlib import redirect_stdout
from pathlib import Path

import meshio
import numpy as np

from pdrom.errors import MeshError
from pdrom.mesh.generators import boundary
from pdrom.mesh.types import Mesh

ALLOWED_CELLS = ("triangle", "tetra")


def read_mesh_file(path: Path) -> Mesh:
    """Read triangles or tetrahedra from any format that meshio knows (.obj, .vtu, .msh, .ply ...).

    Raises
    ------
    MeshError
        The file is missing or unreadable, holds other cells, or mixes triangles and tetrahedra.
    """
    if not path.is_file():
        raise MeshError(f"{path}: no such mesh file")
    try:
        # meshio reports some faults by printing and leaving the process
        with redirect_stdout(io.StringIO()):
            raw = meshio.read(path)
    except (SystemExit, Exception) as error:
        raise MeshError(f"{path}: not a readable mesh ({error})") from error
    cells = {block.type: [] for block in raw.cells}
    for block in raw.cells:
        cells[block.type].append(block.data)
    kinds = [kind for kind in cells if kind not in ("vertex", "line")]
    if len(kinds) != 1 or kinds[0] not in ALLOWED_CELLS:
        raise MeshError(
            f"{path}: holds cells {kinds or 'of no kind'}, "
            f"allowed: only one of {', '.join(ALLOWED_CELLS)}"
        )
    elements = np.concatenate(cells[kinds[0]]).astype(np.int32)
    points = np.ascontiguousarray(raw.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"{path}: points of shape {points.shape}, required: (N, 3)")
    if kinds[0] == "triangle":
        return Mesh(points, elements)
    return Mesh(points, boundary(elements), elements)
