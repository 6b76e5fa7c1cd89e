"""VTK's legacy .vtk: unstructured grids and polygons, as text and binary.

Source: VTK file formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pdrom.model.meshfiles.faults import (
    CORNERS,
    CutError,
    UnreadableError,
    check_last_number,
    only_kind,
)

TYPES = {
    "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4",
    "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "vtkidtype": "i4",
    "vtktypeint32": "i4", "vtktypeint64": "i8", "float": "f4", "double": "f8",
}  # fmt: skip
NAMES = {
    5: "triangle", 6: "triangle strip", 7: "polygon", 8: "pixel", 9: "quad", 10: "tetra",
    12: "hexahedron", 13: "wedge", 14: "pyramid",
}  # fmt: skip
POINTS_AND_LINES = (1, 2, 3, 4)
SECTIONS = {"VERTICES": 2, "LINES": 4, "TRIANGLE_STRIPS": 6, "POLYGONS": 7}


@dataclass
class _Cells:
    """Start of the corners of each cell in ``corners``, their number, and its type."""

    starts: np.ndarray
    sizes: np.ndarray
    corners: np.ndarray
    types: np.ndarray


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3), triangles (E, 3) or tetrahedra (E, 4) of ``path``; polygons may have 3
    corners.

    Raises
    ------
    UnreadableError
        No legacy file, a structured grid, an unknown section, other cells.
    CutError
        Fewer numbers than the counts say.
    """
    with path.open("rb") as file:
        version = re.match(rb"# vtk DataFile Version (\d+)", file.readline())
        file.readline()
        layout = file.readline().strip().upper()
        if version is None or layout not in (b"ASCII", b"BINARY"):
            raise UnreadableError("no '# vtk DataFile Version' with ASCII or BINARY")
        points, found = _Sections(file, int(version[1]) >= 5, layout == b"ASCII").read()
        if layout == b"ASCII":
            file.seek(0)
            check_last_number(file.read(), len(points))
    types = [np.where((cells.types == 7) & (cells.sizes == 3), 5, cells.types) for cells in found]
    kept = [~np.isin(kinds, POINTS_AND_LINES) for kinds in types]
    taken = np.unique(np.concatenate([t[k] for t, k in zip(types, kept, strict=True)]))
    width = CORNERS[only_kind(NAMES.get(t, f"type {t}") for t in taken)]
    if any((cells.sizes[keep] != width).any() for cells, keep in zip(found, kept, strict=True)):
        raise UnreadableError(f"a cell of type {taken[0]} that has not {width} corners")
    parts = [
        cells.corners[cells.starts[keep][:, None] + np.arange(width)]
        for cells, keep in zip(found, kept, strict=True)
    ]
    return points, np.concatenate(parts)


class _Sections:
    """The sections of an open file, up to its data on points and cells."""

    def __init__(self, file: BinaryIO, offsets: bool, text: bool) -> None:
        self._file = file
        self._offsets = offsets  # since version 5: where a cell begins, not how many corners it has
        self._text = text
        self._size = os.fstat(file.fileno()).st_size

    def read(self) -> tuple[np.ndarray, list[_Cells]]:
        """Points (N, 3) and the cells of each section."""
        points, found, announced = None, [], False
        while words := self._words():
            match [words[0].upper(), *words[1:]]:
                case ["DATASET", kind] if kind.upper() in ("UNSTRUCTURED_GRID", "POLYDATA"):
                    pass
                case ["METADATA"]:
                    while self._file.readline().strip():
                        pass
                case ["FIELD", _, arrays]:
                    for _ in range(_count(arrays)):
                        _, width, rows, kind = self._expected(4)
                        self._numbers(_count(width) * _count(rows), kind)
                case ["POINTS", count, kind]:
                    points = self._numbers(3 * _count(count), kind).reshape(-1, 3)
                case ["CELLS", count, size]:
                    found.append(self._cells(_count(count), _count(size), 0))
                    announced = True
                case ["CELL_TYPES", count] if announced:
                    found[-1].types = self._numbers(_count(count), "int").astype(np.int64)
                    announced = False
                case [section, count, size] if section in SECTIONS:
                    found.append(self._cells(_count(count), _count(size), SECTIONS[section]))
                case ["POINT_DATA" | "CELL_DATA", *_]:
                    break
                case _:
                    raise UnreadableError(f"the section {' '.join(words)[:80]!r} is not read")
        if points is None or not found or announced:
            missing = "POINTS" if points is None else "CELL_TYPES" if announced else "cells"
            raise CutError(f"the file ends before its {missing}")
        if any(len(cells.types) != len(cells.sizes) for cells in found):
            raise UnreadableError("CELL_TYPES are not as many as CELLS")
        return points.astype(np.float64), found

    def _words(self) -> list[str]:
        """Words of the next line that holds any; none at the end of the file."""
        for line in iter(self._file.readline, b""):
            if line.strip():
                if not line.endswith(b"\n"):
                    raise CutError("the last line has no end")
                return line.decode(errors="replace").split()
        return []

    def _expected(self, count: int) -> list[str]:
        words = self._words()
        if len(words) != count:
            raise (
                CutError("the file ends within its fields or cells")
                if not words
                else (UnreadableError(f"the line {' '.join(words)[:80]!r}"))
            )
        return words

    def _cells(self, count: int, size: int, kind: int) -> _Cells:
        if self._offsets:
            offsets = self._numbers(count, self._expected(2)[1])
            corners = self._numbers(size, self._expected(2)[1]).astype(np.int64)
            starts, sizes = offsets[:-1].astype(np.int64), np.diff(offsets).astype(np.int64)
        else:
            corners = self._numbers(size, "int").astype(np.int64)
            starts = _starts(corners, count)
            sizes = corners[starts - 1]
        if len(starts) and ((sizes < 0).any() or (starts + sizes > len(corners)).any()):
            raise UnreadableError("cells that are longer than the list of their corners")
        return _Cells(starts, sizes, corners, np.full(len(starts), kind))

    def _numbers(self, count: int, kind: str) -> np.ndarray:
        """The next numbers; text is read in full precision, whatever its type."""
        if kind.lower() not in TYPES:
            raise UnreadableError(f"numbers of type {kind[:40]!r} are not read")
        code = TYPES[kind.lower()]
        here = np.empty(0)
        if count <= self._size:  # else there is no need to try
            wide = "f8" if code[0] == "f" else "i8"
            here = (
                np.fromfile(self._file, wide, count, sep=" ")
                if self._text
                else np.fromfile(self._file, f">{code}", count)
            )
        if len(here) == count:
            return here
        raise CutError(f"{count} numbers that follow each other are announced, fewer are there")


def _count(word: str) -> int:
    if not word.isdigit():
        raise UnreadableError(f"{word[:40]!r} where a count stands")
    return int(word)


def _starts(corners: np.ndarray, count: int) -> np.ndarray:
    """Start of each of ``count`` cells, behind the number of its corners."""
    width = len(corners) // count if count else 1
    if width * count == len(corners) and (corners[::width] == width - 1).all():
        return np.arange(count) * width + 1
    starts: list[int] = []
    at, listed = 0, corners.tolist()
    while at < len(listed) and len(starts) < count and listed[at] >= 0:
        starts.append(at + 1)
        at += listed[at] + 1
    if len(starts) != count or at != len(listed):
        raise UnreadableError(f"{count} cells and a list of another length")
    return np.array(starts, dtype=np.int64)
