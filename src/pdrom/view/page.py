"""A scene with its runs on a page: scripts and runs as plain data in one file.

The page holds the surface alone, some frames, positions of 16 bits."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from math import ceil
from typing import Any

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.packed import pack_positions, pack_text
from pdrom.core.store import write_text
from pdrom.model.effects.base import EffectConfig
from pdrom.model.effects.forces import Gravity
from pdrom.model.mesh.types import Mesh


@dataclass(frozen=True)
class ViewedRun:
    """A reduced run.

    group, method, title : names of what is reduced and how, and the method in words
    positions : (F' + 1, N, 3) m, finite, the initial ones first; it may have ended early
    error : (F',) relative error of each frame
    blowup_frame : None for a run that reached its end
    ms : milliseconds a frame, None where nobody measured
    """

    group: str
    method: str
    title: str
    r: int
    positions: np.ndarray
    error: np.ndarray
    blowup_frame: int | None
    ms: float | None


@dataclass(frozen=True)
class ViewedScene:
    """A scene with its full-order run and the reduced ones.

    time_step : of a frame, s
    positions : (F + 1, N, 3) m of the full order
    ms : milliseconds a frame of the full order, None where nobody measured
    floor : (F,) sensitivity floor, empty where it is not known
    horizon : frame from which on no run can be judged, None if there is none or it is not known
    runs : reduced runs, by group, method and ascending size
    effects : those of the scene; what has a body is shown
    velocities : (F + 1, N, 3) m/s of the full order, None where they were not stored
    first : kind of the run that the others are compared with
    """

    name: str
    title: str
    mesh: Mesh
    time_step: float
    positions: np.ndarray
    ms: float | None
    floor: np.ndarray = field(default_factory=lambda: np.empty(0))
    horizon: int | None = None
    runs: tuple[ViewedRun, ...] = ()
    effects: tuple[EffectConfig, ...] = ()
    velocities: np.ndarray | None = None
    first: str = "full order"

    @property
    def groups(self) -> list[str]:
        """Groups that are reduced."""
        return list(dict.fromkeys(run.group for run in self.runs))

    def sizes(self, group: str, method: str) -> list[ViewedRun]:
        """Runs of a group and a method by ascending size."""
        return [run for run in self.runs if (run.group, run.method) == (group, method)]


LARGEST = 25_000_000  # bytes


def write_page(scenes: Sequence[ViewedScene], path: str | os.PathLike[str]) -> None:
    """Write the viewer of some ``scenes`` to ``path``.

    Raises
    ------
    StorageError
        The page would be larger than a browser opens with ease.
    """
    text = page([pack_scene(scene) for scene in scenes])
    size = len(text.encode())
    if size > LARGEST:
        raise StorageError(
            f"{path}: {size / 1e6:.0f} MB, allowed are {LARGEST / 1e6:.0f}: choose fewer runs"
        )
    write_text(text, path, with_checksum=False)


def page(packed: Sequence[dict]) -> str:
    """The whole page of packed scenes."""
    parts = {
        "STYLE": _read("viewer.css"),
        "SCRIPT": _read("viewer.js"),
        "SCENES": safe_json(packed),
    }
    parts |= {"PACKED": _read("packed.js"), "DRAWING": _read("drawing.js")}
    return filled(_read("viewer.html"), parts)


def _read(name: str) -> str:
    return files("pdrom.view").joinpath(name).read_text(encoding="utf-8")


def safe_json(value: object) -> str:
    """JSON of ``value`` in which no text ends the element that holds it, or opens a comment."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def filled(template: str, parts: dict[str, str]) -> str:
    """Return ``template`` with its ``{{NAME}}`` replaced by ``parts``, which are not looked at."""
    before, *rest = template.split("{{")
    pieces = [before]
    for piece in rest:
        name, _, after = piece.partition("}}")
        pieces += [parts[name], after]
    return "".join(pieces)


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


Y = np.array([0.0, 1.0, 0.0])
EYE = np.array([0.85, 0.55, 1.45])  # direction to the viewer where y points up


def up_of(effects: Sequence[EffectConfig]) -> np.ndarray:
    """Unit vector (3,) against the gravity among ``effects`` of a scene; y where it has none."""
    pull = sum(
        (np.array(e.acceleration) for e in effects if isinstance(e, Gravity.Config)), 0.0 * Y
    )
    strength = float(np.linalg.norm(pull))
    return -pull / strength if strength > 0.0 else Y


def rotation_to(up: np.ndarray) -> np.ndarray:
    """The smallest rotation (3, 3) that takes y to the unit vector ``up``; half a turn about x."""
    cosine = float(up @ Y)
    if cosine <= -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    x, y, z = np.cross(Y, up)
    square = float(x * x + y * y + z * z)
    if square == 0.0:
        return np.eye(3)
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # not divided by 1 + cosine, which loses all digits near half a turn
    return np.eye(3) + turn + turn @ turn * ((1.0 - cosine) / square)


def view_of(effects: Sequence[EffectConfig]) -> dict[str, list[float]]:
    """``up`` and ``eye`` of the picture of a scene with these effects, each (3,)."""
    up = up_of(effects)
    return {"up": up.tolist(), "eye": (rotation_to(up) @ EYE).tolist()}
