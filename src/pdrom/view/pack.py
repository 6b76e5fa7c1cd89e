"""Runs as plain data for the page: the surface alone, some frames, positions of 16 bits."""

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np

from pdrom.core.packed import pack_positions, pack_text
from pdrom.model.effects.base import EffectConfig
from pdrom.view.runs import ViewedRun, ViewedScene
from pdrom.view.view import view_of

FRAMES = 75  # frames that the page holds of a run, at most
ROOM = 0.2  # margin around a run, over its longest side


def pack_scene(scene: ViewedScene) -> dict[str, Any]:
    """A scene for the page; vertices that no triangle has are left out."""
    used, triangles = np.unique(scene.mesh.triangles, return_inverse=True)
    stride = max(1, ceil((len(scene.positions) - 1) / FRAMES))
    full = scene.positions[::stride, used]
    low, high = shown_region(full, scene.effects)
    bodies = [effect.body(low, high) for effect in scene.effects]
    return {
        "name": scene.name,
        "title": scene.title,
        "first": scene.first,
        "triangles": pack_text(triangles.reshape(-1, 3).astype("<u4")),
        "timeStep": scene.time_step,
        "stride": stride,
        "full": pack_positions(full),
        "view": view_of(scene.effects),
        "ranges": np.stack([low, high], axis=1).tolist(),
        "bodies": [
            {
                "points": [_numbers(axis) for axis in body.points.T],
                "triangles": pack_text(body.triangles.astype("<u4")),
            }
            for body in bodies
            if body is not None
        ],
        "ms": scene.ms,
        "floor": _numbers(scene.floor),
        "horizon": scene.horizon,
        "runs": [_pack_run(run, stride, used) for run in scene.runs],
    }


def shown_region(
    positions: np.ndarray, effects: Sequence[EffectConfig]
) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a cube about ``positions`` (F, N, 3) of a run, with room around it, m.

    Obstacles that the run comes near to are shown whole, unless they are larger than the run; runs
    and bodies that leave the cube are cut off. Obstacles are among the ``effects``.
    """
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    size = float((high - low).max())
    for body in (effect.body(low, high) for effect in effects):
        if body is None:
            continue
        lower, upper = body.points.min(axis=0), body.points.max(axis=0)
        near = (lower <= high + ROOM * size).all() and (upper >= low - ROOM * size).all()
        if near and (upper - lower).max() <= size:
            low, high = np.minimum(low, lower), np.maximum(high, upper)
    middle, half = 0.5 * (low + high), (0.5 + ROOM) * float((high - low).max())
    return middle - half, middle + half


def _pack_run(run: ViewedRun, stride: int, used: np.ndarray) -> dict[str, Any]:
    return {
        "group": run.group,
        "method": run.title,
        "r": run.r,
        "positions": pack_positions(run.positions[::stride, used]),
        "error": _numbers(run.error),
        "blowup": run.blowup_frame,
        "ms": run.ms,
    }


def _numbers(values: np.ndarray) -> list[float | None]:
    """Four digits of each number; null where there is none."""
    return [float(f"{v:.4g}") if np.isfinite(v) else None for v in values]
