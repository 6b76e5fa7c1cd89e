"""Readers of .msh, .mesh, .vtk and .vtu, in the order of the file, or an error.

Specifications: reference manual of Gmsh; Medit, INRIA RT-0253; "VTK file formats", Kitware.
"""

import binascii
import lzma
import re
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np

from pdrom.model.mesh import raw

HIGHER = "elements of higher order; only linear elements are read (Gmsh: `-order 1`)"
_LINEAR = {1: (raw.LINE, 2), 2: (raw.TRIANGLE, 3), 3: (raw.QUAD, 4), 4: (raw.TETRA, 4)}
_LINEAR |= {5: (12, 8), 6: (13, 6), 7: (14, 5), 15: (raw.VERTEX, 1)}


def _linear(kind: int) -> tuple[int, int]:
    """Return VTK's number of Gmsh's ``kind`` of elements, and its number of corners."""
    if kind not in _LINEAR:
        raise raw.RefusedError(f"holds {HIGHER} (type {kind})")
    return _LINEAR[kind]


def gmsh(content: bytes) -> raw.Found:
    """Read Gmsh's .msh, formats 2 and 4: nodes and linear elements, of all partitions."""
    head = re.search(rb"\$MeshFormat\s+([24]\.?\d*)\s+([01])\s+([48])" + raw.END, content)
    if head is None:
        raise raw.UnreadableError(
            f"{raw.begin(content)}; only Gmsh's formats 2 and 4 are read, try `meshio convert`"
        )
    order = ("<" if content[head.end()] == 1 else ">") if head[2] == b"1" else ""
    starts = list(re.finditer(rb"^\$(?:Nodes|Elements)" + raw.END, content, re.M))
    raw.require_once([start[0].strip() for start in starts])
    if len(starts) < 2:
        raise raw.CutError("$Nodes or $Elements is missing, or nodes are parametric")
    starts.sort(key=lambda start: start[0], reverse=True)
    nodes, elements = (raw.Source(content, order, start.end()) for start in starts)
    if head[1].startswith(b"2"):
        tags, points = nodes.rows(int(nodes.line()), ("i4", 1), ("f8", 3))
        cells = list(_elements(elements))
    else:
        tags, points, cells = _blocks(nodes, elements, head[1] < b"4.1", "u" + head[3].decode())
    if not all(part.line().startswith(b"$End") for part in (nodes, elements)):
        raise raw.CutError("$Nodes or $Elements without an end mark")
    read = raw.found(points, cells)
    numbered = np.append(raw.whole(tags.ravel(), "numbers of nodes"), -1)
    places = np.argsort(numbered, kind="stable")
    listed = numbered[places]
    at = np.minimum(np.searchsorted(listed, read.corners), len(points))
    if (listed[at] != read.corners).any() or (listed[1:] == listed[:-1]).any():
        raise raw.UnreadableError("elements with unknown nodes, or nodes that are listed twice")
    return read._replace(corners=places[at])


def _elements(source: raw.Source) -> Iterator[tuple[int, np.ndarray]]:
    """Yield kinds and corners of the elements of a section of format 2."""
    count = int(source.line())
    if not source.order:
        head, corner = 3 * (("i4", 1),), ("i4", 1, lambda kind: _linear(kind)[1])
        for _, kind, _, _, corners in source.ragged(count, *head, ("i4", 2, int), corner):
            yield _linear(int(kind[0, 0]))[0], corners
        return
    while count > 0:
        number, length, tags = (int(n) for n in source.rows(1, ("i4", 3))[0][0])
        vtk_kind, width = _linear(number)
        yield vtk_kind, source.rows(length, ("i4", 1 + tags), ("i4", width))[1]
        count -= length


def _blocks(
    nodes: raw.Source, elements: raw.Source, old: bool, size: str
) -> tuple[np.ndarray, np.ndarray, list[tuple[int, np.ndarray]]]:
    """Return node numbers and positions, and elements (format 4.0 if ``old``, else 4.1)."""
    tag = ("i4" if old else size, 1)
    tags, points, cells = list[np.ndarray](), list[np.ndarray](), list[tuple[int, np.ndarray]]()
    for source in (nodes, elements):
        (count, total, *_), *_ = source.rows(1, (size, 2 if old else 4))[0].tolist()
        for _ in range(count):
            what, lengths = source.rows(1, ("i4", 3), (size, 1))
            (entity, dimension, kind), length = what[0].tolist(), int(lengths[0, 0])
            total -= length
            if source is elements:
                number, width = _linear(kind)
                cells.append((number, source.rows(length, tag, (tag[0], width))[1]))
                continue
            axes = ("f8", 3 + (dimension if old else entity) * bool(kind))
            # 4.1 has all tags of a block before the positions
            fields = [(tag, axes)] if old else [(tag,), (axes,)]
            listed, positions = (part for row in fields for part in source.rows(length, *row))
            tags.append(listed)
            points.append(positions[:, :3])
        if total:
            raise raw.CutError("blocks that hold less than announced")
    return np.concatenate(tags), np.concatenate(points), cells


_MEDIT = {b"Vertices": (0, 0), b"Edges": (raw.LINE, 2), b"Triangles": (raw.TRIANGLE, 3)}
_MEDIT |= {b"Quadrilaterals": (raw.QUAD, 4), b"Tetrahedra": (raw.TETRA, 4), b"Hexahedra": (12, 8)}
_MEDIT |= {b"Prisms": (13, 6), b"Pyramids": (14, 5)}


def medit(content: bytes) -> raw.Found:
    """Read Medit's .mesh as text, in two or three dimensions."""
    text = raw.unified(content, comments=True)
    if not re.match(rb"\s*MeshVersionFormatted\b", text):
        raise raw.UnreadableError(
            f"{raw.begin(content)}: not Medit's .mesh as text but another program's; save "
            "the mesh as .vtu or .msh"
        )
    parts = re.split(rb"^[ \t]*([A-Za-z]\w*)", text, flags=re.M)
    names = [name.capitalize() for name in parts[1::2]]
    if b"End" in names:
        names = names[: names.index(b"End")]
    elif names[-1] != b"Tetrahedra":  # the last section of programs that do not write the end mark
        raise raw.CutError("the end mark `End` is missing")
    raw.require_once(names)
    if any(re.search(rb"p\d$", name) for name in names):
        raise raw.RefusedError(f"holds {HIGHER}")
    texts = dict(zip(names, parts[2::2], strict=False))
    axes, read = int(texts[b"Dimension"]), list[tuple[int, np.ndarray]]()
    for name, (kind, width) in _MEDIT.items():
        values = raw.numbers(texts.get(name, b"0"), name.decode())
        columns = 1 + (width or axes)  # behind each row is a reference
        if not len(values) or values[0] * columns != len(values) - 1:
            raise raw.CutError(f"{name.decode()}: another number of rows than announced")
        read.append((kind, values[1:].reshape(-1, columns)[:, :-1]))
    return raw.found(read[0][1], [(kind, rows - 1.0) for kind, rows in read[1:]])


_VTK = re.compile(2 * (rb"([^\r\n]*)" + raw.END) + rb"\s*(ASCII|BINARY)" + raw.END, re.I)
_DATASETS = ("DATASET UNSTRUCTURED_GRID", "DATASET POLYDATA")
_LISTS = {"VERTICES": 2, "LINES": 4, "POLYGONS": raw.POLYGON, "TRIANGLE_STRIPS": 6, "CELLS": 0}


def vtk(content: bytes) -> raw.Found:
    """Read VTK's legacy .vtk, versions 1 to 5: unstructured grids and polygonal data."""
    head = _VTK.match(content)
    if head is None or not head[1].lower().startswith(b"# vtk datafile version"):
        raise raw.UnreadableError(f"{raw.begin(content)}, not with VTK's legacy header")
    source = raw.Source(content, ">" if head[3].upper() == b"BINARY" else "", head.end())
    points, kinds, cells, names = None, None, list[raw.Found](), list[bytes]()
    while words := source.line().decode(errors="replace").split():
        name = words[0].upper()
        if name in ("CELL_DATA", "POINT_DATA"):
            break
        names += [name.encode()] * (name not in ("METADATA", "FIELD") and len(words) < 4)
        if name == "METADATA":
            source.skip(b"\n\n")
        elif len(words) == 4:  # an array of a field
            source.values(int(words[1]) * int(words[2]), words[3])
        elif name == "POINTS":
            points = source.values(3 * int(words[1]), words[2]).reshape(-1, 3)
        elif name == "CELL_TYPES":
            kinds = source.values(int(words[1]), "int")
        elif name in _LISTS:
            offsets = head[1].split()[-1] >= b"5"
            cells.append(_cells(source, _LISTS[name], int(words[1]), int(words[2]), offsets))
        elif name != "FIELD" and " ".join(words).upper() not in _DATASETS:
            raise raw.RefusedError(
                f"holds {' '.join(words)[:60]}; only unstructured grids and polygonal data are "
                "read; ParaView saves other data as .vtu"
            )
        source.check_end(0 if points is None or name == "POINTS" else len(points))
    raw.require_once(names)
    if points is None or not cells or (kinds is None) == (b"CELLS" in names):
        raise raw.CutError("POINTS, cells or CELL_TYPES are missing")
    read = _joined(cells)
    return read._replace(points=points, kinds=read.kinds if kinds is None else kinds)


def _cells(source: raw.Source, kind: int, count: int, size: int, offsets: bool) -> raw.Found:
    """Return cells of a ``kind``: lists of indices, or ``count`` offsets and ``size`` indices."""
    none = np.empty((0, 3))
    if not offsets:
        cells = raw.found(none, [(kind, rows) for rows in source.lists(count)])
        if len(cells.corners) != size - count:
            raise raw.CutError(f"lists of {size} numbers are announced")
        return cells
    ends, corners = (
        raw.whole(source.values(length, source.line().split()[1].decode()), "cells")
        for length in (count, size)
    )
    return raw.Found(none, np.full(max(0, count - 1), kind), np.diff(ends), corners)


def _joined(parts: list[raw.Found]) -> raw.Found:
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    each = [part._replace(corners=part.corners + n) for part, n in zip(parts, starts, strict=False)]
    return raw.Found(*(np.concatenate(arrays) for arrays in zip(*each, strict=True)))


_INFLATE: dict[str, Callable[[bytes], bytes]]
_INFLATE = {"vtkZLibDataCompressor": zlib.decompress, "vtkLZMADataCompressor": lzma.decompress}


def vtu(content: bytes) -> raw.Found:
    """Read VTK's .vtu: the pieces of an unstructured grid, one after another."""
    end = content.rfind(b"</VTKFile>")
    head, _, data = content[: max(0, end)].partition(b"<AppendedData")
    try:
        root = ElementTree.fromstring(head + b"</VTKFile>")
    except ElementTree.ParseError as error:
        raise raw.CutError(f"no end mark </VTKFile>, or no XML: {error}") from error
    pieces = root.findall("UnstructuredGrid/Piece")
    if not pieces:
        raise raw.RefusedError(
            f"holds a {root.get('type')} without pieces of an UnstructuredGrid; only this kind "
            "is read; ParaView saves other data as one"
        )
    plain, data = b"raw" in data.partition(b">")[0], data.partition(b"_")[2].rpartition(b"<")[0]
    read = partial(_array, root.attrib, data, plain)
    return _joined([_piece(piece, read) for piece in pieces])


def _piece(piece: ElementTree.Element, read: Callable[..., np.ndarray]) -> raw.Found:
    points, cells = int(piece.get("NumberOfPoints", 0)), int(piece.get("NumberOfCells", 0))
    positions = read(piece.find("Points/DataArray"), 3 * points).reshape(-1, 3)
    arrays = {array.get("Name"): array for array in piece.iterfind("Cells/DataArray")}
    tags = [*(node.tag for node in piece), *(n.get("Name", "") for n in piece.iterfind("Cells/*"))]
    raw.require_once([tag.encode() for tag in tags])
    kinds, ends = (raw.whole(read(arrays.get(key), cells), key) for key in ("types", "offsets"))
    corners = raw.whole(read(arrays.get("connectivity"), ends[-1] if cells else 0), "connectivity")
    if ((corners < 0) | (corners >= points)).any():
        raise raw.UnreadableError("a piece with corners that are not among its points")
    return raw.Found(positions, kinds, np.diff(ends, prepend=0), corners)


def _array(
    file: dict[str, str], appended: bytes, plain: bool, node: ElementTree.Element | None, count: int
) -> np.ndarray:
    """Return the ``count`` numbers of an array; ``file`` are the attributes of the whole file.

    The bytes ``appended`` after all pieces are ``plain`` or in base 64.
    """
    if node is None or not count:
        values = np.empty(0)
    elif node.get("format", "ascii") == "ascii":
        values = raw.numbers((node.text or "").encode(), "an array")
    else:
        data = (node.text or "").encode()
        if node.get("format") == "appended":
            data = appended[int(node.get("offset", 0)) :]
        if not (plain and node.get("format") == "appended"):
            # parts that are encoded separately end with = or where the next part begins
            data = b"".join(map(binascii.a2b_base64, re.findall(rb"[^=]+=*", data)))
        order = ">" if file.get("byte_order") == "BigEndian" else "<"
        size = 8 if file.get("header_type") == "UInt64" else 4
        word = f"{order}u{size}"
        if compressor := file.get("compressor"):
            if not (inflate := _INFLATE.get(compressor)):
                raise raw.RefusedError(f"compressed by {compressor}: save it uncompressed")
            blocks = int(np.frombuffer(data, word, 1)[0])
            sizes = np.frombuffer(data, word, blocks, 3 * size).tolist()
            ends = np.cumsum([(3 + blocks) * size, *sizes]).tolist()
            data = b"".join(inflate(data[a:b]) for a, b in pairwise(ends))
        else:
            data = data[size : size + int(np.frombuffer(data, word, 1)[0])]
        values = np.frombuffer(data, order + raw.TYPES[node.get("type", "").lower()])
    if len(values) != count:
        raise raw.CutError(f"an array has {len(values)} numbers instead of {count}")
    return values
