"""Wavefront's .obj.

Source: Advanced Visualizer manual, appendix B1 (Object files), Alias/Wavefront.
"""

import re
from pathlib import Path

import numpy as np

from pdrom.model.meshfiles.faults import (
    UnreadableError,
    check_last_number,
    kind_of_face,
    numbers,
    only_kind,
    whole,
)

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
    content = path.read_bytes()
    vertices: list[bytes] = []
    faces: list[bytes] = []
    before: list[int] = []  # vertices when a face is read: negative indices count from there
    whole_lines = re.sub(rb"\\[ \t]*\r?\n", b" ", content)
    for line in whole_lines.splitlines():
        words = line.split(None, 1)
        if not words or words[0].startswith(b"#"):
            continue
        rest = words[1] if len(words) == 2 else b""
        if words[0] == b"v":
            vertices.append(rest)
        elif words[0] in (b"f", b"fo"):
            faces.append(rest.partition(b"#")[0])
            before.append(len(vertices))
        elif words[0] not in IGNORED:
            word = words[0][:20].decode(errors="replace")
            raise UnreadableError(f"the statement {word!r} is not read")
    if any(b"/" in face for face in faces):
        faces = [re.sub(rb"/\S*", b"", face) for face in faces]
    only_kind(kind_of_face(corners) for corners in {len(face.split()) for face in faces})
    points = numbers(vertices, 3, "vertices")
    corners = whole(numbers(faces, 3, "faces"), "faces with corners")
    check_last_number(content, len(points))
    return points, np.where(corners < 0, corners + np.array(before)[:, None], corners - 1)
