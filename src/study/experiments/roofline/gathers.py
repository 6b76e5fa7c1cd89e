"""Traffic of gathers and scatters: vertices that a local kernel visits, in its order.

A visit moves a vector between a register and the nearest cache, whoever visited the vertex before;
a line of that cache is fetched where it is not among those that were used last. Both follow from
the index arrays alone.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.lanes import LANES

LINE = 64  # bytes of a line
KEPT = 512  # lines of the smallest nearest cache of today's processors, 32 KiB
IN_LINE = LINE // (8 * WIDTH)  # vertices of a line


def visits(group: ConstraintGroup) -> list[np.ndarray]:
    """Vertices that ``group`` gathers from, then scatters to, piece by piece.

    A piece is four elements, corner by corner, or the row of an element whose rows differ.
    """
    corners = getattr(group, "stencil", None)
    if corners is None:
        return np.split(group.S.indices, group.S.indptr[1:-1])
    count = corners.shape[1]
    packed = group.streamed[0].reshape(-1, count, LANES // WIDTH, WIDTH)
    return list(packed.transpose(0, 2, 1, 3).reshape(-1, count * WIDTH))


def fetched(group: ConstraintGroup) -> tuple[int, int]:
    """Lines of positions, and of the right-hand side, that a pass over ``group`` fetches."""
    pieces = visits(group)
    beside = sum(array.nbytes for array in group.streamed) / LINE / max(len(pieces), 1)
    found = {"y": 0, "rhs": 0, "own": 0}
    for name, _ in _missed(_lines(pieces, beside)):
        found[name] += 1
    return found["y"], found["rhs"]


def _lines(pieces: Iterable[np.ndarray], beside: float) -> Iterator[tuple[str, int]]:
    """Lines in the order of their use; ``beside`` of each piece are the group's own arrays'."""
    read = 0
    for number, piece in enumerate(pieces, start=1):
        own = range(read, read := int(number * beside))
        used = (piece // IN_LINE).tolist()
        for name, lines in (("y", used), ("own", own), ("rhs", used)):
            yield from ((name, line) for line in lines)


def _missed(lines: Iterable[tuple[str, int]]) -> Iterator[tuple[str, int]]:
    """Lines that are not among the `KEPT` different ones that were used last."""
    recent: dict[tuple[str, int], None] = {}
    for line in lines:
        if line in recent:
            del recent[line]
        else:
            yield line
            if len(recent) == KEPT:
                del recent[next(iter(recent))]
        recent[line] = None
