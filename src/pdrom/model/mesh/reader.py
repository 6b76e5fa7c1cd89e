"""Reads one mesh file in a process of its own, which `pdrom.model.mesh.files` starts.

Readers trust their input: cut files make them loop without end, and a few megabytes of compressed
zeros unpack to gigabytes. The limits that hold here end only this process. It is a script that
imports of the package only `pdrom.model.meshfiles`, so that it starts in a fraction of a second.

usage: reader.py FILE FORMATS SECONDS MEMORY VERTICES CELLS

``FORMATS`` are names of readers, joined by commas; how the file begins chooses between them. What
comes out is points (N, 3) float64 and cells (E, 3 or 4) int64 as two arrays of NumPy's format .npy,
or, with the exit status `REFUSED`, a sentence that states what is wrong.
"""

import io
import os
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace

from pdrom.model.meshfiles import obj
from pdrom.model.meshfiles.guards import (
    CORNERS,
    CutError,
    RefusedError,
    UnreadableError,
    check_after,
    check_before,
    ends_noticed,
    only_kind,
    reason,
    without_faces,
)

REFUSED = 3
NO_MEMORY = 4
# How a file begins whose extension leaves two formats.
OPENINGS = {"ansys": b"(", "gmsh": b"$"}


def main(path: str, formats: str, *numbers: str) -> int:
    """Read the file ``path`` and write its arrays; the exit status.

    ``formats`` are meshio's names, separated by commas; ``numbers`` are the limits: seconds, bytes,
    vertices, cells.
    """
    seconds, memory, vertices, cells = map(int, numbers)
    _limit("RLIMIT_CPU", seconds)
    _limit("RLIMIT_AS", memory)
    _limit("RLIMIT_CORE", 0)
    try:
        # readers warn, and report some faults by printing and leaving the process
        with redirect_stdout(io.StringIO()) as said, redirect_stderr(said):
            arrays = read(path, formats.split(","), vertices, cells)
        _write(arrays)
    except MemoryError:
        os._exit(NO_MEMORY)  # an orderly end would need memory
    except ValueError as error:
        sys.stdout.buffer.write(str(error).encode())
        return REFUSED
    return 0


def _limit(name: str, value: int) -> None:
    """Lower a limit of this process, where the platform has it."""
    try:
        import resource

        kind = getattr(resource, name)
        hard = resource.getrlimit(kind)[1]
        allowed = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (allowed, hard))
    except (ImportError, AttributeError, ValueError, OSError):
        return


def read(path: str, formats: list[str], max_vertices: int, max_cells: int) -> tuple:
    """Points (N, 3) float64 and cells (E, 3 or 4) int64 of the file ``path``.

    Parameters
    ----------
    formats : names that meshio has for the format, the likeliest first
    max_vertices, max_cells : more are refused

    Raises
    ------
    ValueError
        Says what is wrong with the file.
    """
    import numpy as np

    with open(path, "rb") as file:
        begins = file.read(64).lstrip()[:1]
    name = next((name for name in formats if OPENINGS.get(name) == begins), formats[0])
    try:
        points, cells = obj.read(Path(path)) if name == "obj" else _by_meshio(path, name)
        # of a damaged file they may be no arrays, which the conversion refuses
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
    """Points and cells that meshio's reader finds, where they are those of the file."""
    import meshio
    import numpy as np
    from meshio.gmsh import _gmsh40
    from meshio.gmsh import main as gmsh
    from meshio.ugrid import _ugrid

    _ugrid.file_types["ascii"]["float_type"] = "f8"  # meshio rounds what is text to single
    gmsh._readers["4"] = _gmsh40  # as Gmsh calls 4.0; meshio takes it for 4.1
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
    """A hint where a text may have been cut within a line."""
    end = Path(path).read_bytes()[-80:]
    cut = end and b"\0" not in end and not end.endswith((b"\n", b"\r"))
    return "; cut off? The last line has no end" if cut else ""


def _check_size(what: str, found: int, allowed: int) -> None:
    if found > allowed:
        raise RefusedError(f"holds {found} {what}, allowed: at most {allowed}")


def _write(arrays: tuple) -> None:
    import numpy as np

    # NumPy asks a real file for its position, which a pipe has not
    pipe = SimpleNamespace(write=sys.stdout.buffer.write)
    for array in arrays:
        np.save(pipe, array, allow_pickle=False)
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
