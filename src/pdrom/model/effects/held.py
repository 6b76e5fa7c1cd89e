"""Vertices that the boundaries of a scene hold together, and their targets."""

from collections.abc import Sequence

import numpy as np

from pdrom.model.effects.base import Boundary


def held_vertices(boundaries: Sequence[Boundary], frame: int) -> np.ndarray:
    """Vertices that any of the ``boundaries`` holds in ``frame``, ascending (n,) int64."""
    held = [b.held(frame) for b in boundaries if b.active(frame)]
    return np.unique(np.concatenate(held)) if held else np.empty(0, dtype=np.int64)


def held_targets(
    boundaries: Sequence[Boundary], frame: int, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The vertices that are held in ``frame``, as `held_vertices`, and their targets (n, 3) m.

    ``positions`` (N, 3) m are those at the frame's beginning; ``boundaries`` are the scene's.
    """
    vertices, path = held_path(boundaries, range(frame, frame + 1), positions)
    return vertices, path[0]


def held_path(
    boundaries: Sequence[Boundary], frames: range, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`held_targets` of the first of ``frames``, and of those whose targets are known by then.

    Targets are (n, m, 3) m for n >= 1 frames: up to the first in which others are held, or in which
    any are taken hold of.

    Parameters
    ----------
    positions : (N, 3) m at the beginning of the first frame
    """
    active = [b for b in boundaries if b.active(frames.start)]
    held = [b.held(frames.start) for b in active]
    current = [positions[v] for v in held]
    single = len(active) == 1 and bool((held[0][1:] > held[0][:-1]).all())
    vertices, first = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    if single:
        vertices = held[0]
    elif active:
        vertices, first = np.unique(np.concatenate(held), return_index=True)
    known = 1
    while known < len(frames) and not (
        any(b.active(frames[known]) != (b in active) for b in boundaries)
        or any(b.takes_hold(frames[known]) for b in active)
    ):
        known += 1
    paths = [b.path(frames[:known], q) for b, q in zip(active, current, strict=True)]
    if single:
        return vertices, np.array(paths[0], order="C")  # a view is another type, compiled again
    return vertices, np.concatenate([np.empty((known, 0, 3)), *paths], axis=1)[:, first]
