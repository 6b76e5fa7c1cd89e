"""Place labels next to curves and marks, where they cover little of the figure."""

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np

from pdrom.view.artists import Axes

FONT = 7.5  # points
HEIGHT, OFFSET, MARK = 0.115, 0.07, 0.03  # inches: label's height and distance, radius of a mark
SIDES = {-1: ("right", "top"), 0: ("center", "center"), 1: ("left", "bottom")}
# Offsets of a label in units of `OFFSET`: to the right and up.
OFFSETS = [(1, 0), *product(SIDES, (1, -1)), (-1, 0), *product((0, 1, -1, 3.4, -3.4), (2.2, -2.2))]
PASSES = 3
Curve = tuple[str, str, np.ndarray]  # label, colour, points (n, 2) in data coordinates
Place = tuple[float, int, int, np.ndarray]  # cost, number of the point, of the offset, and box


def label_curves(ax: Axes, curves: Sequence[Curve], size: tuple[float, float]) -> None:
    """Write the label of each curve next to one of its points, in the colour of the curve.

    Of all places around the points of a curve, the label gets the place where it covers least ink
    and text. When all labels have places, each label is placed again. ``size`` is the approximate
    size of ``ax`` in inches; the limits of ``ax`` must have been set. Labels also avoid curves that
    have no label.
    """
    from matplotlib.textpath import TextPath

    scaled = [_inches(ax, points, size) for *_, points in curves]
    ink, places = np.concatenate([_dense(points) for points in scaled]), dict[int, Place]()
    texts = {i: TextPath((0, 0), label, FONT) for i, (label, *_) in enumerate(curves) if label}
    for i in [*texts] * PASSES:
        taken = [box for k, (*_, box) in places.items() if k != i]
        tried = [
            (_cost(box, size, ink, taken) + 0.002 * preference**2, int(at), preference, box)
            for at in np.flatnonzero(np.isfinite(scaled[i]).all(axis=1))
            for preference, offset in enumerate(OFFSETS)
            for box in [_box(scaled[i][at], texts[i].get_extents().x1 / 72.0, offset)]
        ]
        places |= {i: min(tried, key=lambda each: each[0])} if tried else {}
    for i, (_, at, preference, _) in places.items():
        (label, colour, points), offset = curves[i], OFFSETS[preference]
        sides = [SIDES[int(np.sign(way))][axis] for axis, way in enumerate(offset)]
        ax.annotate(
            label, points[at], 72.0 * OFFSET * np.array(offset), textcoords="offset points",
            ha=sides[0], va=sides[1], color=colour, fontsize=FONT, zorder=6,
        )  # fmt: skip


def _inches(ax: Axes, points: np.ndarray, size: tuple[float, float]) -> np.ndarray:
    """Return ``points`` (n, 2) of ``ax`` in inches from its lower left corner."""
    return ax.transLimits.transform(ax.transScale.transform(points)) * np.array(size)


def _box(point: np.ndarray, width: float, offset: tuple[float, float]) -> np.ndarray:
    """Return the lower left and upper right corner (inches) of a label next to ``point``."""
    corner = point + OFFSET * np.array(offset) + 0.5 * (np.sign(offset) - 1.0) * (width, HEIGHT)
    return np.stack([corner, np.add(corner, (width, HEIGHT))])


def _cost(
    box: np.ndarray, size: tuple[float, float], ink: np.ndarray, taken: list[np.ndarray]
) -> float:
    """Measure how much a label in ``box`` covers: space outside the axes, ink, other labels."""
    outside = np.maximum(-box[0], 0.0).sum() + np.maximum(box[1] - size, 0.0).sum()
    covered = ((ink > box[0] - 0.02) & (ink < box[1] + 0.02)).all(axis=1).sum()
    clashes = sum((box[0] < b[1]).all() and (b[0] < box[1]).all() for b in taken)
    return float(1e3 * outside + covered + 50.0 * clashes)


def _dense(points: np.ndarray) -> np.ndarray:
    """Return points every 0.02 inches on the lines through the finite ``points`` (n, 2)."""
    points = points[np.isfinite(points).all(axis=1)]
    lines = [np.linspace(a, b, 2 + int(np.abs(b - a).max() / 0.02)) for a, b in pairwise(points)]
    return np.concatenate([*(points + m for m in product((-MARK, MARK), repeat=2)), *lines])
