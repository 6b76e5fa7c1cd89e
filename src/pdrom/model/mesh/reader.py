"""Script that reads one mesh file in a separate process, started by `pdrom.model.mesh.files`.

meshio does not validate its input: truncated files cause endless loops, and a few megabytes of
compressed zeros unpack to gigabytes. Limits on time and memory therefore end only this process.
The script imports nothing else of the package, so that it starts in a fraction of a second.

Files from which meshio would read a wrong mesh are rejected by checks before and after its call.
If meshio accepts truncated files of a format, the end of the file is checked first. This module
reads .obj files itself (Advanced Visualizer manual, appendix B1, Alias/Wavefront).

usage: reader.py FILE FORMATS SECONDS MEMORY VERTICES CELLS

``FORMATS`` are meshio's names of possible formats, joined by commas; the first byte of the file
decides between them. The next four are limits: seconds, bytes, numbers of vertices and of cells.
Standard output is points (N, 3) float64 and cells (E, 3 or 4) int64 as two arrays in NumPy's format
.npy, or, with the exit status `REFUSED`, a sentence that states the fault.
"""

import builtins
import io
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

REFUSED = 3
NO_MEMORY = 4
# Format -> first byte of its files, for formats that share an extension.
OPENINGS = {"ansys": b"(", "gmsh": b"$"}


def main(path: str, formats: str, *numbers: str) -> int:
    """Write points and cells of the mesh file ``path`` to standard output; return the exit status.

    The parameters are the arguments of the script, in the order that the module's text states.
    """
    seconds, memory, vertices, cells = map(int, numbers)
    _limit("RLIMIT_CPU", seconds)
    _limit("RLIMIT_AS", memory)
    _limit("RLIMIT_CORE", 0)
    try:
        # what meshio prints is discarded, as standard output must hold nothing but the arrays
        with redirect_stdout(io.StringIO()) as said, redirect_stderr(said):
            arrays = read(path, formats.split(","), vertices, cells)
        # np.save asks a file object for its position, which a pipe lacks
        pipe = SimpleNamespace(write=sys.stdout.buffer.write)
        for array in arrays:
            np.save(pipe, array, allow_pickle=False)
        sys.stdout.flush()
    except MemoryError:
        os._exit(NO_MEMORY)  # end at once: a normal exit would need memory
    except ValueError as error:
        sys.stdout.buffer.write(str(error).encode())
        return REFUSED
    return 0


def _limit(name: str, value: int) -> None:
    """Lower the resource limit ``name`` of this process to ``value`` if the platform has it."""
    try:
        import resource

        kind = getattr(resource, name)
        hard = resource.getrlimit(kind)[1]
        allowed = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (allowed, hard))
    except (ImportError, AttributeError, ValueError, OSError):
        return


def read(path: str, formats: list[str], max_vertices: int, max_cells: int) -> tuple:
    """Return points (N, 3) float64 and cells (E, 3 or 4) int64 of the file ``path``.

    Raises ValueError, whose message states why, if the file is not a readable mesh.

    Parameters
    ----------
    formats : meshio's names of possible formats, the most likely one first
    max_vertices, max_cells : largest allowed numbers of vertices and cells
    """
    with open(path, "rb") as file:
        begins = file.read(64).lstrip()[:1]
    name = next((name for name in formats if OPENINGS.get(name) == begins), formats[0])
    try:
        points, cells = read_obj(Path(path)) if name == "obj" else _by_meshio(path, name)
        # the points of a damaged file may be no array, which is rejected by the conversion below
        _check_size("vertices", len(np.atleast_1d(points)), max_vertices)
        _check_size("cells", len(cells), max_cells)
        points = np.ascontiguousarray(points, dtype=np.float64)
        cells = cells.astype(np.int64, casting="same_kind")
    except MemoryError:
        raise
    except RefusedError as error:
        raise ValueError(f"{error}{_last_line(path)}") from error
    except (SystemExit, Exception) as error:
        hint = _last_line(path)
        if isinstance(error, CutError):
            hint = ""
        elif name != "obj":
            hint += f"; of {name} files the plain form is read: save it as .vtu, .msh or .obj"
        raise ValueError(f"not a readable mesh ({reason(error)}{hint})") from error
    for array, what, widths in ((points, "points", (3,)), (cells, "cells", (3, 4))):
        if array.ndim != 2 or array.shape[1] not in widths:
            width = " or ".join(map(str, widths))
            raise ValueError(f"{what} of shape {array.shape}, required: (N, {width})")
    return points, cells


def _by_meshio(path: str, name: str) -> tuple:
    """Read points and cells by meshio's reader ``name``; raise if it may misread the file."""
    import meshio
    from meshio.gmsh import _gmsh40
    from meshio.gmsh import main as gmsh
    from meshio.ugrid import _ugrid

    _ugrid.file_types["ascii"]["float_type"] = "f8"  # meshio would round numbers in text to float32
    gmsh._readers["4"] = _gmsh40  # Gmsh writes version "4" for 4.0, which meshio reads as 4.1
    content = Path(path).read_bytes()
    check_before(name, content)
    with ends_noticed():
        raw = meshio.read(path, file_format=name)
    check_after(name, content, raw)
    blocks: dict[str, list] = {}
    for block in raw.cells:
        if block.type not in ("vertex", "line"):
            blocks.setdefault(block.type, []).append(block.data)
    found = without_faces({kind: np.concatenate(data) for kind, data in blocks.items()})
    kind = only_kind(found)
    if found[kind].shape[1:] != (CORNERS[kind],):
        raise UnreadableError(f"{kind} with a shape of {found[kind].shape[1:]}")
    flat = raw.points.ndim == 2 and raw.points.shape[1] == 2
    return np.pad(raw.points, ((0, 0), (0, 1))) if flat else raw.points, found[kind]


def _last_line(path: str) -> str:
    """Return a remark that a text file without a final newline may be truncated, else ""."""
    end = Path(path).read_bytes()[-80:]
    cut = end and b"\0" not in end and not end.endswith((b"\n", b"\r"))
    return "; cut off? The last line has no end" if cut else ""


def _check_size(what: str, found: int, allowed: int) -> None:
    if found > allowed:
        raise RefusedError(f"holds {found} {what}, allowed: at most {allowed}")


# Accepted kinds of cells -> number of corners.
CORNERS = {"triangle": 3, "tetra": 4}
_LAST_NUMBER = re.compile(rb"(?:^|\s)([-+]?[\d.]+(?:[eE][-+]?\d*)?)\Z")


class UnreadableError(ValueError):
    """A file that is not a valid mesh file of its format, or that would be read incorrectly."""


class RefusedError(ValueError):
    """A readable mesh that is too large or has other cells than `CORNERS` allows."""


class CutError(UnreadableError):
    """A truncated file, which stops before the end of its mesh."""

    def __init__(self, why: str) -> None:
        super().__init__(f"cut off: {why}")


def only_kind(kinds: Iterable[str]) -> str:
    """Return the only cell kind in ``kinds``; `RefusedError` unless it is one kind of `CORNERS`."""
    found = list(dict.fromkeys(kinds))
    if len(found) != 1 or found[0] not in CORNERS:
        raise RefusedError(
            f"holds cells {found or 'of no kind'}, allowed: only one of {', '.join(CORNERS)}"
        )
    return found[0]


def check_last_number(content: bytes, vertices: int) -> None:
    """Raise `CutError` if the text ``content`` ends with a number that may be truncated.

    Without an end of line, ``12`` may be the first digits of ``123``. A last index is accepted if
    one more digit would exceed the number of ``vertices``.
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
    """Return the message of an ``error`` as one line of at most about 200 characters."""
    text = " ".join(str(error).split())[:200]
    if isinstance(error, UnreadableError):
        return text
    if isinstance(error, SystemExit):
        return "no reader takes it"
    return f"{type(error).__name__}: {text}"


# More than PATIENCE reads, of less than PIECE bytes, past the end of a file mean an endless loop.
PIECE, PATIENCE = 4096, 100
# Format -> pattern that no truncated file has. `check_after`, `ends_noticed` check other formats.
ENDS = {
    "ansys": rb"\)\s*\Z",
    "gmsh": rb"^\$End\w+\s*\Z",
    "medit": rb"\A\x01\0\0\0|^\s*End\s*\Z",  # or a binary file, which has no end mark
    "nastran": rb"^ENDDATA",
    "netgen": rb"^\s*endmesh\s*$",  # not the end: a geometry section may follow
    "permas": rb"^\s*\$FIN",
    "stl": rb"^\s*endsolid[^\n]*\s*\Z",
    "vtu": rb"</VTKFile>\s*\Z",
    "wkt": rb"\)\s*\Z",
}
# Format -> pattern of lines that meshio ignores though they change the mesh, and error message.
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
# Format -> pattern of what begins a section or a numbered vertex; of two meshio reads the last.
ONCE = {
    "flac3d": rb"^[ \t]*(G[ \t]+\d+)\b",
    "gmsh": rb"^(\$(?:MeshFormat|Nodes|Elements))\b",
    "medit": rb"^\s*(Dimension|Vertices)\b",
    "nastran": rb"^[ \t]*(GRID\*?[ \t,]+\d+)\b",
    "netgen": rb"^\s*(points|dimension)\s*$",
    "ply": rb"^(element\s+(?:vertex|face))\b",
    "su2": rb"^\s*(NDIME|NPOIN|NELEM)\s*=",
    "tecplot": rb"^\s*(VARIABLES)\b",
    # sections, not a title or an array of the same name
    "vtk": rb"^[ \t]*(DATASET(?=\s+\w+\s*$)|POINTS(?=\s+\d+\s+[a-z])"
    rb"|CELLS(?=\s+\d+\s+\d+\s*$)|CELL_TYPES(?=\s+\d+\s*$))",
    "vtu": rb"<(Piece|Points|Cells)\b|\bName\s*=\s*[\"'](connectivity|offsets|types)[\"']",
}


def check_before(name: str, content: bytes) -> None:
    """Raise an error if meshio's reader ``name`` would read ``content`` incorrectly.

    Raises
    ------
    CutError
        The end mark of this format is missing.
    UnreadableError
        A section stands there twice, or the reader would ignore a line that changes the mesh,
        or vertex numbers that are not in ascending order.
    """
    binary = name == "stl" and 84 + 50 * int.from_bytes(content[80:84], "little") == len(content)
    if name in ENDS and not binary and not re.search(ENDS[name], content, re.M):
        raise CutError("the file does not end as this format does")
    sections = re.finditer(ONCE[name], content, re.M | re.I) if name in ONCE else ()
    words = (section[section.lastindex or 0].replace(b",", b" ") for section in sections)
    begun = [b" ".join(word.split()) for word in words]
    names = [section.upper() for section in begun]
    first = {section: n for n, section in reversed([*enumerate(names)])}
    if twice := [n for n, section in enumerate(names) if first[section] < n]:
        raise UnreadableError(f"{begun[twice[0]].decode()} appears twice")
    if name == "wkt" and content.count(b"(") != content.count(b")"):
        raise CutError("brackets that are not closed")  # the reader would run for hours
    if name in PASSED_OVER:
        pattern, why = PASSED_OVER[name]
        found = re.search(pattern, content, re.M | re.S | re.I)
        if found:
            raise UnreadableError(f"{next(filter(None, found.groups())).decode()}: {why}")
    if name == "su2":
        _check_order(content)


def check_after(name: str, content: bytes, mesh: Any) -> None:
    """Raise an error if ``mesh``, from meshio's reader ``name``, may differ from ``content``.

    Raises
    ------
    CutError
        There are fewer elements than announced, or the last number may be truncated.
    UnreadableError
        A Nastran file gives vertices in another coordinate system than Nastran's basic one.
    """
    if name == "nastran" and np.any(mesh.point_data.get("nastran:ref", 0)):
        raise UnreadableError("GRID with a coordinate system (CP): only the basic one is read")
    there = sum(len(cells.data) for cells in mesh.cells)
    announced = {there}
    if name == "su2":
        counts = re.findall(rb"^[ \t]*(?:NELEM|MARKER_ELEMS)[ \t]*=[ \t]*(\d+)", content, re.M)
        announced = {sum(map(int, counts))}
    elif name == "vtk":
        offsets = content.startswith(b"# vtk DataFile Version 5")  # "CELLS n" means n - 1 cells
        counts = re.findall(
            rb"^[ \t]*(CELLS|CELL_TYPES)[ \t]+(\d+)(?:[ \t]+\d+)?\s*$", content, re.M | re.I
        )
        announced = {int(count) - (offsets and word.upper() == b"CELLS") for word, count in counts}
    elif name in ("off", "ply") and b"\0" not in content:
        rows = [row for row in content.splitlines() if row.partition(b"#")[0].strip()]
        head = next((n for n, row in enumerate(rows, 1) if row.strip() == b"end_header"), 2)
        if len(rows) > head + len(mesh.points) + there:
            raise UnreadableError("more rows than the file announces")
    if announced - {there}:
        raise CutError(f"{min(announced - {there})} elements are announced, {there} are there")
    if name not in ENDS and b"\0" not in content:
        check_last_number(content, len(mesh.points))


def _check_order(content: bytes) -> None:
    """Raise UnreadableError if .su2 vertices are not numbered in order, as meshio assumes."""
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
    """Return ``cells`` (kind -> array) without the triangles if all are faces of tetrahedra.

    Mesh generators often also write the boundary faces, which follow from the tetrahedra.
    """
    if cells.keys() != {"triangle", "tetra"}:
        return cells
    faces = cells["tetra"][:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
    size = max(int(corners.max(initial=0)) for corners in cells.values()) + 1

    def number(triangles: np.ndarray) -> np.ndarray:
        a, b, c = np.sort(triangles.astype(np.int64), axis=1).T
        return (a * size + b) * size + c  # an integer per face; 64 bits suffice for 10^6 vertices

    known = np.isin(number(cells["triangle"]), number(faces)).all()
    return {"tetra": cells["tetra"]} if known else cells


@contextmanager
def ends_noticed() -> Iterator[None]:
    """Context in which a reader fails on a truncated file, instead of looping or reading less.

    Files opened in it record reads past their end. ``numpy.fromfile`` raises `CutError` if there
    are fewer numbers than requested.
    """
    opened, fromfile = builtins.open, np.fromfile
    ends: list[int] = []

    def noticing(path: Any, mode: str = "r", *more: Any, **named: Any) -> Any:
        if more or named or mode not in ("r", "rb"):
            return opened(path, mode, *more, **named)
        file: Any = _Bytes(io.FileIO(path))
        file.ends = ends
        if mode == "r":
            file = _Text(file, encoding="utf-8")
            file.ends = ends
        return file

    def whole(file: Any, *more: Any, **named: Any) -> np.ndarray:
        count = named.get("count", more[1] if len(more) > 1 else -1)
        if count > os.fstat(file.fileno()).st_size:  # checked before NumPy allocates so much memory
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


class _Noticing:
    """Mixin for file classes: each read past the end of the file is recorded in ``ends``."""

    ends: list[int]

    def readline(self, size: int | None = -1, /) -> Any:
        line = super().readline(size)  # type: ignore[misc]
        if not line:
            self.note()
        return line

    def note(self) -> None:
        self.ends.append(1)
        if len(self.ends) > PATIENCE:
            raise EOFError("a reader that goes on for ever")


class _Text(_Noticing, io.TextIOWrapper):
    """A text file that records reads past its end."""


class _Bytes(_Noticing, io.BufferedReader):
    """A binary file that records reads past its end."""

    def read(self, size: int | None = -1, /) -> bytes:
        content = super().read(size)
        # a large read is not noted: code that reads large pieces may request more than is left
        if size and len(content) < size < PIECE:
            self.note()
        return content


# Statements of .obj files that do not change vertex positions or faces. Others (free-form surfaces,
# `call` of another file) are rejected, because a part of the mesh would be missing.
IGNORED = frozenset(
    b"vt vn vp g o s l p mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj "
    b"trace_obj".split()
)


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return an .obj file's points (N, 3), without weights w, and triangles (E, 3), indices from 0.

    Raises UnreadableError for an unknown statement, a face corner that is no integer, a bad number.
    """
    # comments are removed first, as a backslash at their end does not continue the line
    content = re.sub(rb"#[^\r\n]*", b"", path.read_bytes())
    vertices: list[bytes] = []
    faces: list[bytes] = []
    before: list[int] = []  # number of vertices before each face; a corner -1 is the last of these
    whole_lines = re.sub(rb"\\[ \t]*(?:\r\n|\r|\n)", b" ", content)
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
    """Return the first ``columns`` numbers of each row; error messages begin with ``what``."""
    if not rows:
        return np.empty((0, columns))
    if not all(map(bytes.strip, rows)):
        raise UnreadableError(f"{what}: a row without numbers")
    try:
        return np.loadtxt(rows, usecols=range(columns), ndmin=2, encoding="latin-1")
    except (ValueError, IndexError) as error:
        raise UnreadableError(f"{what}: {error}") from error


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
