"""Wavefront's .obj.

Source: Advanced Visualizer manual, appendix B1 (Object files), Alias/Wavefront.
"""

import re
from pathlib import Path

import numpy as np

from pdrom.model.meshfiles.guards import UnreadableError, check_last_number, only_kind

# Statements that say nothing about the positions of vertices or the corners of faces. All others
# (free-form surfaces, `call` of another file) are refused: without them a part would be missing.
IGNORED = frozenset(
    b"vt vn vp g o s l p mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj "
    b"trace_obj".split()
)


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and triangles (E, 3) of ``path``, from 0; weights w of vertices are for curves.

    Raises
    ------
    UnreadableError
        A statement that is not read, faces of other than three corners, no number.
    """
    # comments go first: one that ends in a backslash does not go on in the next line
    content = re.sub(rb"#[^\n]*", b"", path.read_bytes())
    vertices: list[bytes] = []
    faces: list[bytes] = []
    before: list[int] = []  # vertices when a face is read: negative indices count from there
    whole_lines = re.sub(rb"\\[ \t]*\r?\n", b" ", content)
    for line in whole_lines.splitlines():
        words = line.split(None, 1)
        if not words:
            continue
        rest = words[1] if len(words) == 2 else b""
        if words[0] == b"v":
            vertices.append(rest)
        elif words[0] in (b"f", b"fo"):
            faces.append(rest)
            before.append(len(vertices))
        elif words[0] not in IGNORED:
            word = words[0][:20].decode(errors="replace")
            raise UnreadableError(f"the statement {word!r} is not read")
    if any(b"/" in face for face in faces):
        faces = [re.sub(rb"/\S*", b"", face) for face in faces]
    kinds = {3: "triangle", 4: "quad"}
    only_kind(kinds.get(corners, "polygon") for corners in {len(face.split()) for face in faces})
    points = _numbers(vertices, 3, "vertices")
    corners = _numbers(faces, 3, "faces")
    if not (np.abs(corners) < 2**53).all() or (corners != np.floor(corners)).any():
        raise UnreadableError("faces with corners that are no whole numbers")
    corners = corners.astype(np.int64)
    check_last_number(content, len(points))
    return points, np.where(corners < 0, corners + np.array(before)[:, None], corners - 1)


def _numbers(rows: list[bytes], columns: int, what: str) -> np.ndarray:
    """First ``columns`` numbers of every row, (rows, columns) float64; ``what`` names a fault."""
    if not rows:
        return np.empty((0, columns))
    try:
        return np.loadtxt(rows, usecols=range(columns), ndmin=2, encoding="latin-1")
    except (ValueError, IndexError) as error:
        raise UnreadableError(f"{what}: {error}") from error
