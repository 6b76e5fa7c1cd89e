"""Mesh files, read by meshio."""

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np

from pdrom.core.errors import MeshError
from pdrom.model.mesh.checks import check_indices
from pdrom.model.mesh.generators import boundary, orient
from pdrom.model.mesh.types import Mesh

MAX_BYTES = 500_000_000
ALLOWED_CELLS = ("triangle", "tetra")


def read_mesh_file(path: Path) -> Mesh:
    """Read triangles or tetrahedra from any format that meshio knows (.obj, .vtu, .msh, .ply ...).

    Raises
    ------
    MeshError
        The file is missing or unreadable, holds other cells, or mixes triangles and tetrahedra.
    """
    # a fifth of a second that only scenes with a mesh file pay
    import meshio

    if not path.is_file():
        raise MeshError(f"{path}: no such mesh file")
    if path.stat().st_size > MAX_BYTES:
        raise MeshError(f"{path}: larger than {MAX_BYTES} bytes")
    try:
        # meshio reports some faults by printing and leaving the process
        with redirect_stdout(io.StringIO()) as said, redirect_stderr(said):
            raw = meshio.read(path)
    except (SystemExit, Exception) as error:
        raise MeshError(f"{path}: not a readable mesh ({_reason(error)})") from error
    cells = {block.type: [] for block in raw.cells}
    for block in raw.cells:
        cells[block.type].append(block.data)
    kinds = [kind for kind in cells if kind not in ("vertex", "line")]
    if len(kinds) != 1 or kinds[0] not in ALLOWED_CELLS:
        raise MeshError(
            f"{path}: holds cells {kinds or 'of no kind'}, "
            f"allowed: only one of {', '.join(ALLOWED_CELLS)}"
        )
    try:
        elements = np.concatenate(cells[kinds[0]])
        points = np.ascontiguousarray(raw.points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MeshError(f"{path}: not a readable mesh ({_reason(error)})") from error
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"{path}: points of shape {points.shape}, required: (N, 3)")
    check_indices(elements, len(points), kinds[0], str(path))
    if kinds[0] == "triangle":
        return Mesh(points, elements.astype(np.int32))
    # formats differ in how they number the corners
    tetrahedra = orient(points, elements)
    return Mesh(points, boundary(tetrahedra), tetrahedra)


def _reason(error: BaseException) -> str:
    """What went wrong, on one short line."""
    if isinstance(error, SystemExit):
        return "no reader takes it"
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
