"""Reads one mesh file in a process of its own, which `pdrom.model.mesh.files` starts.

Readers trust their input: cut files make them loop without end, and a few megabytes of compressed
zeros unpack to gigabytes. The limits that hold here end only this process. It is a script that
imports nothing of the package, so that it starts in a fraction of a second.

usage: reader.py FILE FORMATS SECONDS MEMORY VERTICES CELLS

``FORMATS`` are names of meshio's readers, joined by commas and tried in turn. What comes out is
points (N, 3) float64 and cells (E, 3 or 4) int64 as two arrays of NumPy's format .npy, or, with
the exit status `REFUSED`, a sentence that says what is wrong.
"""

import io
import os
import sys
from contextlib import redirect_stderr, redirect_stdout
from types import SimpleNamespace

REFUSED = 3
NO_MEMORY = 4
ALLOWED_CELLS = ("triangle", "tetra")


def main(path: str, formats: str, *numbers: str) -> int:
    """Read the file and write its arrays; the exit status."""
    seconds, memory, vertices, cells = map(int, numbers)
    _limit("RLIMIT_CPU", seconds)
    _limit("RLIMIT_AS", memory)
    _limit("RLIMIT_CORE", 0)
    try:
        # readers warn, and report some faults by printing and leaving the process
        with redirect_stdout(io.StringIO()) as said, redirect_stderr(said):
            arrays = _read(path, formats.split(","), vertices, cells)
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


def _read(path: str, formats: list[str], max_vertices: int, max_cells: int) -> tuple:
    """Points and cells of the file; ValueError says what is wrong with it."""
    import meshio
    import numpy as np

    raw = fault = None
    for name in formats:
        try:
            raw = meshio.read(path, file_format=name)
            break
        except MemoryError:
            raise
        except (SystemExit, Exception) as error:
            # the first reader is the usual one: its fault says most
            fault = fault or _reason(error)
    if raw is None:
        raise ValueError(f"not a readable mesh ({fault})")
    kinds = list(dict.fromkeys(b.type for b in raw.cells if b.type not in ("vertex", "line")))
    if len(kinds) != 1 or kinds[0] not in ALLOWED_CELLS:
        raise ValueError(
            f"holds cells {kinds or 'of no kind'}, allowed: only one of {', '.join(ALLOWED_CELLS)}"
        )
    blocks = [block.data for block in raw.cells if block.type == kinds[0]]
    # of a damaged file they may be no arrays, which the conversion refuses
    _check_size("vertices", len(np.atleast_1d(raw.points)), max_vertices)
    _check_size("cells", sum(len(np.atleast_1d(block)) for block in blocks), max_cells)
    try:
        points = np.ascontiguousarray(raw.points, dtype=np.float64)
        cells = np.concatenate(blocks).astype(np.int64, casting="same_kind")
    except (TypeError, ValueError) as error:
        raise ValueError(f"not a readable mesh ({_reason(error)})") from error
    corners = 3 if kinds[0] == "triangle" else 4
    for array, what, width in ((points, "points", 3), (cells, kinds[0], corners)):
        if array.ndim != 2 or array.shape[1] != width:
            raise ValueError(f"{what} of shape {array.shape}, required: (N, {width})")
    return points, cells


def _check_size(what: str, found: int, allowed: int) -> None:
    if found > allowed:
        raise ValueError(f"holds {found} {what}, allowed: at most {allowed}")


def _write(arrays: tuple) -> None:
    import numpy as np

    # NumPy asks a real file for its position, which a pipe has not
    pipe = SimpleNamespace(write=sys.stdout.buffer.write)
    for array in arrays:
        np.save(pipe, array, allow_pickle=False)
    sys.stdout.flush()


def _reason(error: BaseException) -> str:
    """What went wrong, on one short line."""
    if isinstance(error, SystemExit):
        return "no reader takes it"
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
