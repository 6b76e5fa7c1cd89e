"""Checks of a file before meshio reads it and while it does, and the faults that readers name.

meshio trusts its input. Where it would read another mesh than the file holds, the file is refused
here; where it takes the end of a file for the end of its mesh, the end is looked at first.
"""

import builtins
import io
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

# Kinds of cells that are wanted, and how many corners they have.
CORNERS = {"triangle": 3, "tetra": 4}
_LAST_NUMBER = re.compile(rb"(?:^|\s)([-+]?[\d.]+(?:[eE][-+]?\d*)?)\Z")


class UnreadableError(ValueError):
    """A file that is no mesh of its format, or one that would be read wrong."""


class RefusedError(ValueError):
    """A mesh that is read, and is not what is wanted."""


class CutError(UnreadableError):
    """A file that ends before its mesh does."""

    def __init__(self, why: str) -> None:
        super().__init__(f"cut off: {why}")


def only_kind(kinds: Iterable[str]) -> str:
    """The one kind of cells of a mesh among ``kinds``; `RefusedError` for none or another."""
    found = list(dict.fromkeys(kinds))
    if len(found) != 1 or found[0] not in CORNERS:
        raise RefusedError(
            f"holds cells {found or 'of no kind'}, allowed: only one of {', '.join(CORNERS)}"
        )
    return found[0]


def check_last_number(content: bytes, vertices: int) -> None:
    """`CutError` if the text ``content`` ends in what may be the beginning of a longer number.

    Only the end of the line distinguishes ``12`` from the first digits of ``123``. An index that
    could not be longer, as there are not so many ``vertices``, is taken.
    """
    last = _LAST_NUMBER.search(content[-64:])
    if last is None:
        return
    number = last[1].decode()
    digits = number.lstrip("+-")
    if not digits.isdigit() or 0 < 10 * int(digits) <= vertices:
        raise CutError(
            f"the last line has no end and may go on after {number} (add an end of line if not)"
        )


def reason(error: BaseException) -> str:
    """Message of an error, on one short line."""
    text = " ".join(str(error).split())[:200]
    if isinstance(error, UnreadableError):
        return text
    if isinstance(error, SystemExit):
        return "no reader takes it"
    return f"{type(error).__name__}: {text}"


# Bytes that are read at once by who reads piece by piece; reads behind the end before it is a loop.
PIECE, PATIENCE = 4096, 100
# What a whole file holds, of formats that mark their end; others state how much they hold.
ENDS = {
    "ansys": rb"\)\s*\Z",
    "gmsh": rb"^\$End\w+\s*\Z",
    "medit": rb"\A\x01\0\0\0|^\s*End\s*\Z",  # a binary one ends with a number
    "nastran": rb"^ENDDATA",
    "netgen": rb"^\s*endmesh\s*$",  # the geometry may follow
    "permas": rb"^\s*\$FIN",
    "stl": rb"^\s*endsolid[^\n]*\s*\Z",
    "vtu": rb"</VTKFile>\s*\Z",
    "wkt": rb"\)\s*\Z",
}
# Lines that meshio passes over, and what they would change.
PASSED_OVER = {
    "nastran": (
        rb"^[ \t]*(GRDSET|INCLUDE|(?:CTRI|CTETRA)\w*\*)",
        "no other coordinate systems and files are read, and no elements in large fields",
    ),
    "ply": (
        rb"\A(?:ply\s.*?^(element face)\b.*?^element vertex\b"
        rb"|ply\s+format binary.*?^element face\b[^\n]*\n"
        rb"(?:property list [^\n]*\n(property)|(property) (?!list)))",
        "vertices, then faces that are corners alone, are read",
    ),
    "su2": (rb"^[ \t]*(NZONE[ \t]*=[ \t]*0*(?:[2-9]|1\d))", "one zone is read"),
    "tecplot": (rb"^[ \t]*ZONE\b.*?^[ \t]*(ZONE)\b", "one zone is read"),
}


def check_before(name: str, content: bytes) -> None:
    """Refuse a file with this ``content`` that meshio's reader ``name`` would read wrong.

    Raises
    ------
    CutError
        The mark is missing that ends a file of this format.
    UnreadableError
        A line that the reader passes over though it changes the mesh, or vertices that are
        numbered in another order than they are listed, where the reader takes no notice.
    """
    binary = name == "stl" and 84 + 50 * int.from_bytes(content[80:84], "little") == len(content)
    if name in ENDS and not binary and not re.search(ENDS[name], content, re.M):
        raise CutError("the file does not end as this format does")
    if name == "wkt" and content.count(b"(") != content.count(b")"):
        raise CutError("brackets that are not closed")  # the reader would try for hours
    if name in PASSED_OVER:
        pattern, why = PASSED_OVER[name]
        found = re.search(pattern, content, re.M | re.S | re.I)
        if found:
            raise UnreadableError(f"{next(filter(None, found.groups())).decode()}: {why}")
    if name == "su2":
        _check_order(content)


def check_after(name: str, content: bytes, mesh: Any) -> None:
    """Refuse, or repair, the ``mesh`` that meshio's reader ``name`` has read from ``content``.

    Raises
    ------
    CutError
        The last number may be the beginning of a longer one.
    UnreadableError
        Vertices in a coordinate system of their own, or with equal numbers.
    """
    if name == "nastran" and np.any(mesh.point_data.get("nastran:ref", 0)):
        raise UnreadableError("GRID with a coordinate system (CP): only the basic one is read")
    there = sum(len(cells.data) for cells in mesh.cells)
    announced = {there}
    if name == "su2":
        counts = re.findall(rb"^[ \t]*(?:NELEM|MARKER_ELEMS)[ \t]*=[ \t]*(\d+)", content, re.M)
        announced = {sum(map(int, counts))}
    elif name == "vtk":
        offsets = content.startswith(b"# vtk DataFile Version 5")  # one more than there are cells
        counts = re.findall(rb"^(CELLS|CELL_TYPES)[ \t]+(\d+)", content, re.M)
        announced = {int(count) - (offsets and word == b"CELLS") for word, count in counts}
    if announced - {there}:
        raise CutError(f"{min(announced - {there})} elements are announced, {there} are there")
    if name not in ENDS and b"\0" not in content:
        check_last_number(content, len(mesh.points))


def _check_order(content: bytes) -> None:
    """Refuse a .su2 file whose vertices are numbered out of order: meshio ignores the numbers."""
    dimension = re.search(rb"^[ \t]*NDIME[ \t]*=[ \t]*(\d+)", content, re.M)
    points = re.search(rb"^[ \t]*NPOIN[ \t]*=[ \t]*(\d+)[^\n]*\n", content, re.M)
    if dimension is None or points is None:
        raise CutError("NDIME or NPOIN is missing")
    axes, count = int(dimension[1]), int(points[1])
    lines = content[points.end() :].split(b"\n", count)[:count]
    listed = [words[axes] for line in lines if len(words := line.split()) > axes]
    if any(number != b"%d" % place for place, number in enumerate(listed)):
        raise UnreadableError("NPOIN: vertices are numbered in another order than 0, 1, 2 ...")


def without_faces(cells: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Drop the triangles of ``cells`` (by kind) if all of them are faces of its tetrahedra.

    Meshers write the boundary of a volume, which says no more than the tetrahedra do.
    """
    if cells.keys() != {"triangle", "tetra"}:
        return cells
    faces = cells["tetra"][:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
    size = max(int(corners.max(initial=0)) for corners in cells.values()) + 1

    def number(triangles: np.ndarray) -> np.ndarray:
        a, b, c = np.sort(triangles.astype(np.int64), axis=1).T
        return (a * size + b) * size + c  # a million vertices leave it in 64 bits

    known = np.isin(number(cells["triangle"]), number(faces)).all()
    return {"tetra": cells["tetra"]} if known else cells


@contextmanager
def ends_noticed() -> Iterator[None]:
    """Let a reader fail when the file ends too early, where it would loop or take less.

    While it holds, files that are opened notice reads behind their end, and ``numpy.fromfile``
    raises `CutError` for fewer numbers than were requested.
    """
    opened, fromfile = builtins.open, np.fromfile
    ends: list[int] = []

    def noticing(path: Any, mode: str = "r", *more: Any, **named: Any) -> Any:
        if more or named or mode not in ("r", "rb"):
            return opened(path, mode, *more, **named)
        file = _Bytes(io.FileIO(path), ends)
        return file if mode == "rb" else _Text(file, ends)

    def whole(file: Any, *more: Any, **named: Any) -> np.ndarray:
        count = named.get("count", more[1] if len(more) > 1 else -1)
        if count > os.fstat(file.fileno()).st_size:  # before as much memory is taken
            raise CutError(f"{count} numbers that follow each other, the file is shorter")
        array = fromfile(file, *more, **named)
        if len(array) < count:
            raise CutError(f"{count} numbers that follow each other, {len(array)} are there")
        return array

    builtins.open, np.fromfile = noticing, whole  # type: ignore[assignment]
    try:
        yield
    except (UnreadableError, MemoryError):
        raise
    except (SystemExit, Exception) as error:
        if ends:
            raise CutError(f"the file ends where more is expected ({reason(error)})") from error
        raise
    finally:
        builtins.open, np.fromfile = opened, fromfile


class _Text(io.TextIOWrapper):
    """A text file that notes in ``ends`` how often it was read behind its end."""

    def __init__(self, file: io.BufferedReader, ends: list[int]) -> None:
        super().__init__(file, encoding="utf-8")
        self._ends = ends

    def readline(self, size: int = -1, /) -> str:  # type: ignore[override]
        line = super().readline(size)
        if not line:
            _note(self._ends)
        return line


class _Bytes(io.BufferedReader):
    """A binary file that notes in ``ends`` how often it was read behind its end."""

    def __init__(self, file: io.FileIO, ends: list[int]) -> None:
        super().__init__(file)
        self._ends = ends

    def readline(self, size: int | None = -1, /) -> bytes:
        line = super().readline(size)
        if not line:
            _note(self._ends)
        return line

    def read(self, size: int | None = -1, /) -> bytes:
        content = super().read(size)
        # readers of the whole file ask for all, or for large pieces
        if size and len(content) < size < PIECE:
            _note(self._ends)
        return content


def _note(ends: list[int]) -> None:
    ends.append(1)
    if len(ends) > PATIENCE:
        raise EOFError("a reader that goes on for ever")
