"""Readers of surface files: .obj, .off, .ply and .stl, in the order of the file, or an error.

Specifications: .obj, Advanced Visualizer manual, appendix B1 (Alias/Wavefront); .off, Geomview 1.9;
.ply, Turk (1994); .stl, 3D Systems (1989).
"""

import re

import numpy as np

from pdrom.model.mesh import raw

# Statements of .obj files that do not change vertex positions or faces. Others (free-form surfaces,
# `call` of another file) are rejected, because a part of the mesh would be missing.
IGNORED = frozenset(
    b"vt vn vp g o s mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj "
    b"trace_obj".split()
)


def obj(content: bytes) -> raw.Found:
    """Read Wavefront's .obj, without weights w and colours of vertices."""
    # comments are removed first, as a backslash at their end does not continue the line; if the
    # file ends with a backslash, it is kept and makes the reading of numbers fail
    text = re.sub(rb"\\[ \t]*\n(?!\s*\Z)", b" ", raw.unified(content, comments=True))
    vertices, faces, lines, last = list[bytes](), list[bytes](), 0, b""
    before: list[int] = []  # number of vertices before each face; a corner -1 is the last of these
    for line in filter(bytes.strip, text.split(b"\n")):
        last, rest, *_ = (*line.split(None, 1), b"")
        if last == b"v":
            vertices.append(rest)
        elif last in (b"f", b"fo"):
            faces.append(rest)
            before.append(len(vertices))
        elif last in (b"l", b"p"):
            lines += 1
        elif last not in IGNORED:
            word = last[:20].decode(errors="replace")
            raise raw.UnreadableError(f"the statement {word!r} is not read")
    points = _columns(vertices)
    # parts of each corner of the last face, which a truncated file may lack
    forms = {re.sub(rb"[^/]+", b"1", corner) for corner in faces[-1].split()} if faces else set()
    if any(b"/" in face for face in faces):
        faces = [re.sub(rb"/\S*", b"", face) for face in faces]
    sizes = np.array([len(face.split()) for face in faces], np.int64)
    corners = raw.whole(raw.numbers(b" ".join(faces), "faces"), "faces with corners")
    starts, index = np.repeat(np.array(before, np.int64), sizes), corners[-1:]
    corners = np.where(corners < 0, corners + starts, corners - 1)
    if last in (b"f", b"fo") and len(forms) == 1 and _closed(sizes, corners):
        raw.check_end(content, index[-1], len(points))
    elif last in (b"v", b"f", b"fo"):  # a corner or a part of one may be missing
        raw.check_end(content.rstrip(b" \t"), 0.0, 0)
    kinds, ends = np.repeat([raw.POLYGON, raw.LINE], [len(sizes), lines]), np.zeros(lines, int)
    return raw.Found(points, kinds, np.append(sizes, ends + 2), np.append(corners, [ends, ends]))


def _closed(sizes: np.ndarray, corners: np.ndarray) -> bool:
    """Return whether the last face is complete: all faces have the same number of corners.

    If not, its last edge, which leads back to its first corner, must belong to another face.
    """
    following, ends = np.roll(corners, -1), np.cumsum(sizes)
    following[ends - 1] = corners[ends - sizes]
    edges = np.sort([corners, following], axis=0)
    shared = (edges == edges[:, -1:]).all(axis=0).sum() > 1
    return bool(sizes[-1] > 2 and ((sizes == sizes[0]).all() or shared))


def _columns(rows: list[bytes]) -> np.ndarray:
    """Return the first three numbers (n, 3) of each of the ``rows`` of vertices."""
    if not all(map(bytes.strip, rows)):
        raise raw.UnreadableError("vertices: a row without numbers")
    try:
        return np.loadtxt(rows, usecols=range(3), ndmin=2) if rows else np.empty((0, 3))
    except (ValueError, IndexError) as error:
        raise raw.UnreadableError("vertices with something other than 3 numbers") from error


def off(content: bytes) -> raw.Found:
    """Read Geomview's .off, without normals, colours and texture coordinates."""
    text = raw.unified(content, comments=True)
    head = re.match(rb"\s*(?:(?:ST|C|N)*OFF\b)?\s*(\d+)[ \t]+(\d+)[ \t\d]*\n", text, re.I)
    if head is None:
        raise raw.UnreadableError("no header: OFF, then numbers of vertices and faces as text")
    vertices, count = int(head[1]), int(head[2])
    lines = [line for line in text[head.end() :].split(b"\n") if line.strip()]
    if len(lines) < vertices + count:
        raise raw.CutError(f"{len(lines)} lines instead of {vertices} + {count}")
    if len(lines) > vertices + count:
        raise raw.UnreadableError("more rows than the file announces")
    faces = lines[vertices : vertices + count]
    source = raw.Source(b"\n".join(map(_face, faces)), "")
    cells = [(raw.POLYGON, rows) for rows in source.lists(count)]
    if count and len(_face(faces[-1])) == len(faces[-1].strip()):
        raw.check_end(content, cells[-1][1][-1, -1], vertices)
    return raw.found(_columns(lines[:vertices]), cells)


def _face(line: bytes) -> bytes:
    """Return the ``line`` of a face, a number of corners and the corners, without its colour."""
    words = line.split()
    size = int(words[0])
    if not 0 < size < len(words):
        raise raw.CutError(f"a face of {size} corners lists {len(words) - 1}")
    return b" ".join(words[: 1 + size])


_CORNER = rb"\s+vertex" + 3 * rb"\s+(\S+)"
_FACET = rb"facet\s+normal(?:\s+\S+){3}\s+outer\s+loop" + 3 * _CORNER + rb"\s+endloop\s+endfacet"


def stl(content: bytes) -> raw.Found:
    """Read .stl, binary or text; corners at the same position become one vertex."""
    count = int.from_bytes(content[80:84], "little")
    if len(content) >= 84 + 50 * count:
        facet = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
        corners = np.frombuffer(content, facet, count, 84)["corners"].reshape(-1, 3)
    else:
        text = raw.unified(content).lower()
        ends = re.findall(rb"^[ \t]*(end)?solid\b", text, re.M)
        if ends != [b"", b"end"] * (len(ends) // 2) or not ends:
            raise raw.CutError("fewer facets than announced, or no end mark `endsolid`")
        text = text[: text.rindex(b"endsolid")]
        text = re.sub(rb"^[ \t]*(?:end)?solid\b.*$", b"", text, flags=re.M)
        values = re.sub(_FACET, rb"\1 \2 \3 \4 \5 \6 \7 \8 \9", text)
        corners = raw.numbers(values, "facets").reshape(-1, 3)
    corners = corners + np.float64(0.0)  # turns -0 into 0
    order = np.lexsort(corners.T[::-1])
    points = corners[order]
    new = (np.diff(points, axis=0, prepend=np.nan) != 0.0).any(axis=1)
    index = np.cumsum(new)[order.argsort()] - 1
    return raw.found(points[new], [(raw.TRIANGLE, index.reshape(-1, 3))])


_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_PLY = {(b"vertex", axis): axis for axis in "xyz"}
_PLY |= {(b"face", name): "faces" for name in ("vertex_indices", "vertex_index")}


def ply(content: bytes) -> raw.Found:
    """Read .ply, text or binary: positions and corners, without any other property."""
    head = re.match(rb"ply\s[\s\S]*?[\r\n]end_header" + raw.END, content)
    if head is None:
        raise raw.UnreadableError("no header from `ply` to `end_header`")
    elements: list[tuple[bytes, int, list[list[str]]]] = []
    order = b""
    for line in head[0].splitlines():
        words = line.split()
        if words[:1] == [b"format"]:
            order = words[1]
        elif words[:1] == [b"element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == [b"property"]:
            elements[-1][2].append(line.decode(errors="replace").split())
    raw.require_once([name for name, _, _ in elements])
    source = raw.Source(content, _ORDERS[order], head.end())
    read: dict[str, list[np.ndarray]] = {"x": [], "y": [], "z": [], "faces": []}
    vertices = 0
    for element, count, properties in elements:
        names, parts = list[str](), list[raw.Field | raw.Part]()
        for _, *kinds, name in properties:
            types = [raw.TYPES[kind] for kind in kinds if kind != "list"]
            parts.append((types[0], 1))
            if kinds[0] == "list":  # two fields: the length of a list, and its numbers
                parts.append((types[1], len(names), int))
                names.append("length")
            names.append(name)
        for block in source.ragged(count, *parts):
            for name, values in zip(names, block, strict=True):
                if place := _PLY.get((element, name)):
                    read[place].append(values)
                    if name == names[-1]:
                        source.check_end(vertices)
        vertices = count if element == b"vertex" else vertices
    if not source.order and source.line():
        raise raw.UnreadableError("more rows than the file announces")
    faces = [(raw.POLYGON, rows) for rows in read.pop("faces")]
    columns = [np.concatenate([np.empty((0, 1)), *blocks]) for blocks in read.values()]
    return raw.found(np.hstack(columns), faces)
