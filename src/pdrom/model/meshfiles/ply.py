"""Stanford's .ply, as text and binary.

Source: G. Turk, The PLY polygon file format, 1994.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pdrom.model.meshfiles.faults import (
    CutError,
    UnreadableError,
    check_last_number,
    kind_of_face,
    only_kind,
    whole,
)

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
CORNERS = ("vertex_indices", "vertex_index")
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class Element:
    """A table of the file: ``properties`` are (name, type of a list's count or "", type)."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and triangles (E, 3) of ``path``, whatever else there is.

    Raises
    ------
    UnreadableError
        A faulty header, rows of one element with lists of unlike lengths, faces of other than
        three corners.
    CutError
        Fewer rows than the counts say.
    """
    content = path.read_bytes()
    order, elements, start = _header(content)
    found: dict[str, dict[str, np.ndarray]] = {}
    rest = content[start:]
    lines = [line for line in rest.splitlines() if line.strip()] if order == "" else []
    for element in elements:
        if {"vertex", "face"} <= found.keys():
            break
        if order == "":
            found[element.name] = _text(element, lines[: element.count])
            lines = lines[element.count :]
        else:
            found[element.name], size = _binary(element, rest, order)
            rest = rest[size:]
    vertices, faces = found.get("vertex", {}), found.get("face", {})
    if not {"x", "y", "z"} <= vertices.keys():
        raise UnreadableError("no vertices with the properties x, y and z")
    points = np.column_stack([vertices[axis] for axis in "xyz"]).astype(np.float64)
    cells = next((faces[name] for name in CORNERS if name in faces), None)
    only_kind([] if cells is None else [kind_of_face(cells.shape[1])])
    if order == "":
        check_last_number(content, len(points))
    return points, whole(np.asarray(cells), "faces with corners")


def _header(content: bytes) -> tuple[str, list[Element], int]:
    """The order of bytes ("" for text), the elements, and where the data begin."""
    elements: list[Element] = []
    order, at = None, 0
    while True:
        end = content.find(b"\n", at)
        if end < 0:
            raise CutError("the header has no end_header")
        words = content[at:end].decode(errors="replace").split()
        first, at = at, end + 1
        match words:
            case ["ply"] if first == 0:
                continue
            case _ if first == 0:
                raise UnreadableError("the first line is not ply")
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", name, "1.0"] if name in ORDERS:
                order = ORDERS[name]
            case ["element", name, count] if count.isdigit():
                elements.append(Element(name, int(count)))
            case ["property", "list", n, kind, name] if elements and {n, kind} <= TYPES.keys():
                elements[-1].properties.append((name, TYPES[n], TYPES[kind]))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append((name, "", TYPES[kind]))
            case ["end_header"] if order is not None:
                return order, elements, at
            case _:
                raise UnreadableError(f"the header's line {' '.join(words)[:80]!r}")


def _text(element: Element, rows: list[bytes]) -> dict[str, np.ndarray]:
    """Arrays of the properties of an element whose rows are lines."""
    if not element.count:
        return {}
    _check_rows(element, len(rows))
    try:
        table = np.loadtxt(rows, ndmin=2)
    except ValueError as error:
        raise UnreadableError(f"{element.name}: {error}") from error
    arrays, at = {}, 0
    for name, length, _ in element.properties:
        columns = 1
        if length:
            columns = _length(element, name, table[:, at : at + 1])
            at += 1
        arrays[name] = table[:, at : at + columns]
        at += columns
    if at != table.shape[1]:
        raise UnreadableError(f"{element.name}: rows of {table.shape[1]} numbers, expected: {at}")
    return arrays


def _binary(element: Element, rest: bytes, order: str) -> tuple[dict[str, np.ndarray], int]:
    """Arrays of the properties of an element, and how many bytes it takes."""
    if not element.count:
        return {}, 0
    layout: list[tuple] = []
    for name, length, kind in element.properties:
        columns = 1
        if length:
            layout.append((f"{name} count", order + length))
            at = np.dtype(layout).itemsize - int(length[1])
            if len(rest) < at + int(length[1]):
                _check_rows(element, 0)
            columns = max(0, int(np.frombuffer(rest, order + length, 1, at)[0]))
        layout.append((name, order + kind, (columns,)))
    row = np.dtype(layout)
    there = min(element.count, len(rest) // row.itemsize)
    table = np.frombuffer(rest, row, there)
    for name, length, _ in element.properties:
        if length and there:
            _length(element, name, table[f"{name} count"])
    _check_rows(element, there)
    return {name: table[name] for name, *_ in element.properties}, there * row.itemsize


def _length(element: Element, name: str, counts: np.ndarray) -> int:
    """Length of the lists of a property, which all rows must have."""
    lengths = np.unique(counts)
    if len(lengths) > 1:
        few = ", ".join(f"{length:g}" for length in lengths[:4])
        raise UnreadableError(f"{element.name}: lists {name} of unlike lengths: {few}")
    return int(whole(lengths, f"{element.name}: lengths")[0])


def _check_rows(element: Element, there: int) -> None:
    if there < element.count:
        raise CutError(f"{element.count} rows of {element.name} announced, {there} are there")
