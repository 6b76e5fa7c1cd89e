"""Checks of what holds vertices or stops them: contradictions are refused, doubts are logged."""

import logging
from collections.abc import Sequence
from copy import deepcopy
from itertools import combinations

import numpy as np

from pdrom.core.errors import SceneError
from pdrom.model.effects.base import Boundary, Contact
from pdrom.model.effects.held import held_targets

log = logging.getLogger(__name__)

# Fewer vertices leave a body free to turn about a line.
FEW = 3
# Targets no deeper in an obstacle than this part of the extent lie on it.
SLACK = 1e-9
# Vertices that a message names.
NAMED = 10


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
    """Log how many of the ``vertices`` of ``scene`` (name) each of its ``boundaries`` holds.

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


def log_obstructed(
    boundaries: Sequence[Boundary],
    contacts: Sequence[Contact],
    scene: str,
    points: np.ndarray,
    frames: int,
) -> None:
    """Warn of held vertices whose targets lie inside an obstacle, where they stay.

    Vertices that are taken hold of later are taken to be where obstacles have pushed the mesh at
    rest, ``points`` (N, 3) m.
    """
    obstacles = [contact for contact in contacts if contact.each_alone]
    inside, blocked = np.zeros(len(points), dtype=bool), dict[str, None]()
    # boundaries remember where they took hold
    boundaries, positions = deepcopy(boundaries), points.copy()
    slack = SLACK * float(np.ptp(points, axis=0).max())
    for frame in range(frames if obstacles and boundaries else 0):
        held, targets = held_targets(boundaries, frame, positions)
        positions[held] = targets
        for obstacle in obstacles:
            before = positions.copy()
            obstacle.correct(positions, before)
            pushed = held[np.linalg.norm(positions[held] - targets, axis=1) > slack]
            positions[held] = targets
            if len(pushed):
                inside[pushed], blocked[obstacle.name] = True, None
    vertices = np.flatnonzero(inside)
    if len(vertices):
        named = ", ".join(map(str, vertices[:NAMED])) + (", ..." if len(vertices) > NAMED else "")
        log.warning(
            "scene '%s': %d held vertices have targets inside '%s' and stay there: %s",
            scene, len(vertices), "', '".join(blocked), named,
        )  # fmt: skip


def log_contacts(
    contacts: Sequence[Contact], boundaries: Sequence[Boundary], scene: str, rest: np.ndarray
) -> None:
    """Warn of contacts that do not fit the shape ``rest`` (N, 3) m; held vertices do not count."""
    free = np.ones(len(rest), dtype=bool)
    for boundary in boundaries:
        if boundary.active(0):
            free[boundary.held(0)] = False
    for contact in contacts:
        doubt = contact.doubt(rest, np.flatnonzero(free)) if free.any() else ""
        if doubt:
            log.warning("scene '%s', effect '%s': %s", scene, contact.name, doubt)
