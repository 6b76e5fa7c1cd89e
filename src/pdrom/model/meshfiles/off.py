"""Geomview's .off.

Source: http://www.geomview.org/docs/html/OFF.html
"""

import re
from pathlib import Path

import numpy as np

from pdrom.model.meshfiles.faults import (
    CutError,
    UnreadableError,
    check_last_number,
    kind_of_face,
    numbers,
    only_kind,
    whole,
)

# Texture, colours and normals stand behind the three coordinates of a vertex. With the letters 4
# and n a vertex has other coordinates.
_HEADER = re.compile(rb"(?:ST)?C?N?OFF\b")


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and triangles (E, 3) of ``path``; colours are left out.

    Raises
    ------
    UnreadableError
        Another header, faces of other than three corners, no number.
    CutError
        Fewer lines than the counts say.
    """
    content = path.read_bytes()
    lines = [line for line in re.sub(rb"#.*", b"", content).splitlines() if line.strip()]
    header = _HEADER.match(lines[0].lstrip()) if lines else None
    if header is None or b"BINARY" in lines[0]:
        raise UnreadableError("the first line is not OFF (or COFF, NOFF, STOFF), in text")
    lines[0] = lines[0].lstrip()[header.end() :]
    if not lines[0].strip():  # the counts stand in the first line, or in one of their own
        del lines[0]
    if not lines:
        raise CutError("the file ends before its counts")
    vertices, faces = whole(numbers(lines[:1], 2, "counts")[0], "counts")
    if len(lines) <= vertices + faces:
        raise CutError(
            f"{vertices} vertices and {faces} faces are announced, {len(lines) - 1} lines are there"
        )
    points = numbers(lines[1 : 1 + vertices], 3, "vertices")
    rows = lines[1 + vertices : 1 + vertices + faces]
    sizes = np.unique(whole(numbers(rows, 1, "faces"), "faces with counts"))
    only_kind(kind_of_face(size) for size in sizes)
    cells = whole(numbers(rows, 4, "faces"), "faces with corners")[:, 1:]
    check_last_number(content, len(points))
    return points, cells
