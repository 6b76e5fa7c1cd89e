"""Labels beside curves and marks, at places where little is in their way."""

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np

from pdrom.view.artists import Axes

FONT = 7.5  # points
CHARACTER, HEIGHT, OFFSET = 0.057, 0.115, 0.07  # inches: mean width, height, distance of a label
SIDES = {-1: ("right", "top"), 0: ("center", "center"), 1: ("left", "bottom")}
# Offsets of a label in units of `OFFSET`: to the right and up.
OFFSETS = [(1, 0), *product(SIDES, (1, -1)), (-1, 0), *product(SIDES, (2.2, -2.2))]
PASSES = 3
Curve = tuple[str, str, np.ndarray]  # label, colour, points (n, 2) in data coordinates
Place = tuple[float, int, int, np.ndarray]  # cost, number of the point, of the offset, and box


def label_curves(ax: Axes, curves: Sequence[Curve], size: tuple[float, float]) -> None:
    """Write the label of each curve beside one of its points, in its colour.

    The places that are tried are those around all points of the curve; that with the least ink and
    text in its way is taken, and each label is placed again when the others have their places. The
    approximate ``size`` of ``ax`` is in inches; its limits must have been set. A curve without a
    label is only in the way.
    """
    scaled = [_inches(ax, points, size) for *_, points in curves]
    ink, places = np.concatenate([_dense(points) for points in scaled]), dict[int, Place]()
    named = [i for i, (label, *_) in enumerate(curves) if label]
    for i in named * PASSES:
        taken = [box for k, (*_, box) in places.items() if k != i]
        tried = [
            (_cost(box, size, ink, taken) + 0.02 * preference**2, int(at), preference, box)
            for at in np.flatnonzero(np.isfinite(scaled[i]).all(axis=1))
            for preference, offset in enumerate(OFFSETS)
            for box in [_box(scaled[i][at], curves[i][0], offset)]
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


def _box(point: np.ndarray, label: str, offset: tuple[float, float]) -> np.ndarray:
    """Lower left and upper right corner of ``label`` with an ``offset`` from ``point``, inches."""
    extent = np.array([CHARACTER * len(label), HEIGHT])
    corner = point + OFFSET * np.array(offset) + 0.5 * extent * (np.sign(offset) - 1.0)
    return np.array([corner, corner + extent])


def _cost(
    box: np.ndarray, size: tuple[float, float], ink: np.ndarray, taken: list[np.ndarray]
) -> float:
    """How much lies in the way of a label in ``box``: the border, ``ink``, or other labels."""
    outside = np.maximum(-box[0], 0.0).sum() + np.maximum(box[1] - size, 0.0).sum()
    covered = ((ink > box[0] - 0.02) & (ink < box[1] + 0.02)).all(axis=1).sum()
    clashes = sum((box[0] < b[1]).all() and (b[0] < box[1]).all() for b in taken)
    return float(1e3 * outside + covered + 50.0 * clashes)


def _dense(points: np.ndarray) -> np.ndarray:
    """Points 0.02 apart on the lines through ``points`` (n, 2), without those that are NaN."""
    points = points[np.isfinite(points).all(axis=1)]
    lines = [np.linspace(a, b, 2 + int(np.abs(b - a).max() / 0.02)) for a, b in pairwise(points)]
    return np.concatenate([*[points] * 3, *lines])  # marks count more than lines
