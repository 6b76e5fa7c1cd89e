"""Which vertices a scene holds: contradictions are refused, the numbers are logged."""

import logging
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from pdrom.core.errors import SceneError
from pdrom.model.effects.base import Boundary

log = logging.getLogger(__name__)

# Fewer vertices leave a body free to turn about a line.
FEW = 3


def check_holds(boundaries: Sequence[Boundary], scene: str, frames: int) -> None:
    """SceneError for a vertex that is held twice at once, unless nothing that holds it moves."""
    for first, second in combinations(boundaries, 2):
        if not (first.moves or second.moves):
            continue
        shared = np.intersect1d(first.vertices, second.vertices)
        if len(shared) == 0:
            continue
        for frame in range(frames):
            if first.active(frame) and second.active(frame):
                raise SceneError(
                    f"scene '{scene}': vertex {shared[0]} is held by '{first.name}' and by "
                    f"'{second.name}' in frame {frame}"
                )


def log_holds(boundaries: Sequence[Boundary], scene: str, vertices: int) -> None:
    """Log how many of the mesh's ``vertices`` each effect holds.

    A side that holds fewer than `FEW` is a warning: on an unstructured mesh a side is often one
    single vertex.
    """
    for boundary in boundaries:
        count = len(boundary.vertices)
        counted = f"scene '{scene}', effect '{boundary.name}': holds {count} of {vertices} vertices"
        if boundary.side is None:
            log.info("%s", counted)
        elif count >= FEW:
            log.info("%s (select: %s)", counted, boundary.side)
        else:
            advice = "a list of vertices selects more"
            log.warning("%s, fewer than %d (select: %s; %s)", counted, FEW, boundary.side, advice)
