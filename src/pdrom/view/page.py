"""HTML pages that show runs, or run models: scripts and data in one file.

A page stores only the surface vertices of a run, in some frames, quantised to 16 bits."""

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from math import ceil
from typing import Any

import numpy as np

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.core.packed import pack_positions, pack_text
from pdrom.core.store import write_text
from pdrom.model.effects.base import EffectConfig
from pdrom.model.mesh.types import Mesh
from pdrom.view.camera import rotation_to, shown_region, up_of


@dataclass(frozen=True)
class ViewedRun:
    """A reduced run of F' frames.

    title : name of the run among those of its scene
    positions : (F' + 1, N, 3) m, finite, the initial state first
    error : (F',) relative error of each frame
    blowup_frame : frame in which the run blew up and ended; None if all frames of the scene ran
    ms : milliseconds per frame, None if not measured
    """

    title: str
    positions: np.ndarray
    error: np.ndarray
    blowup_frame: int | None
    ms: float | None


@dataclass(frozen=True)
class ViewedScene:
    """A scene with its full-order run and its reduced runs.

    time_step : time step of a frame, s
    positions : (F + 1, N, 3) m of the full-order run
    ms : milliseconds per frame of the full-order run, None if not measured
    effects : effects of the scene; obstacles among them are drawn
    method : model that computed the run in place of the full-order run
    """

    name: str
    title: str
    mesh: Mesh
    time_step: float
    positions: np.ndarray
    ms: float | None
    runs: tuple[ViewedRun, ...] = ()
    effects: tuple[EffectConfig, ...] = ()
    method: str = "full-order model"


LARGEST = 25_000_000  # largest number of bytes of a page
# Files next to this module that make up a page, its template first.
VIEWER = ("viewer.html", "viewer.css", "packed.js", "drawing.js", "viewer.js")
LIVE = ("live.html", "live.css", "packed.js", "engine.js", "drawing.js", "live.js")


def write_page(scenes: Sequence[ViewedScene], path: str | os.PathLike[str]) -> None:
    """Write an HTML page of ``scenes`` to ``path``; StorageError if above `LARGEST` bytes."""
    require_page(path)
    write_text(page_of(VIEWER, [pack_scene(scene) for scene in scenes]), path, with_checksum=False)


def require_page(path: str | os.PathLike[str]) -> None:
    """Raise ConfigurationError if ``path`` is not the name of a page."""
    if not os.fspath(path).lower().endswith((".html", ".htm")):
        raise ConfigurationError(f"{path}: a page is HTML; end the name in .html")


def page_of(parts: Sequence[str], scenes: Sequence[Mapping[str, Any]]) -> str:
    """Return the page of ``parts`` (`VIEWER`, `LIVE`) with ``scenes``, the data of its script.

    An entry of `LIVE` has a ``scene``'s name and its ``content``, or a ``file`` next to the page
    with the content. StorageError if the page has more than `LARGEST` bytes.
    """
    texts = {name: files("pdrom.view").joinpath(name).read_text("utf-8") for name in parts}
    text = filled(texts[parts[0]], {**texts, "SCENES": safe_json(scenes)})
    size = len(text.encode())
    if size > LARGEST:
        fault = f"{size / 1e6:.0f} MB, allowed are {LARGEST / 1e6:.0f}"
        raise StorageError(f"page of {fault}: choose fewer runs or a smaller model")
    return text


def safe_json(value: object) -> str:
    """Return ``value`` as JSON in which no text can end the script element or open a comment."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def filled(template: str, parts: dict[str, str]) -> str:
    """Replace each ``{{NAME}}`` in ``template`` by its entry of ``parts``, in a single pass."""
    return re.sub(r"\{\{(.+?)\}\}", lambda found: parts[found[1].strip()], template)


EYE = np.array([0.85, 0.55, 1.45])  # direction to the viewer if y points up, else it is rotated
FRAMES = 75  # largest number of frames of a run on the page; the others are skipped


def pack_scene(scene: ViewedScene) -> dict[str, Any]:
    """Return JSON data of ``scene`` for the page, without vertices inside the body."""
    used, triangles = np.unique(scene.mesh.triangles, return_inverse=True)
    stride = max(1, ceil((len(scene.positions) - 1) / FRAMES))
    full = scene.positions[::stride, used]
    low, high = shown_region(full, scene.effects)
    bodies = [body for effect in scene.effects if (body := effect.body(low, high))]
    return {
        "name": scene.name, "title": scene.title, "method": scene.method,
        "triangles": pack_text(triangles.reshape(-1, 3).astype("<u4")),
        "timeStep": scene.time_step, "stride": stride, "full": pack_positions(full),
        "view": view_of(scene.effects), "ranges": np.stack([low, high], axis=1).tolist(),
        "bodies": [
            {"points": [_numbers(axis) for axis in body.points.T],
             "triangles": pack_text(body.triangles.astype("<u4"))}
            for body in bodies
        ],
        "ms": scene.ms, "runs": [
            {"title": run.title, "positions": pack_positions(run.positions[::stride, used]),
             "error": _numbers(run.error), "blowup": run.blowup_frame, "ms": run.ms}
            for run in scene.runs
        ],
    }  # fmt: skip


def view_of(effects: Sequence[EffectConfig]) -> dict[str, list[float]]:
    """Return directions ``up`` and to the ``eye`` for a page of a scene with these ``effects``."""
    up = up_of(effects)
    return {"up": up.tolist(), "eye": (rotation_to(up) @ EYE).tolist()}


def _numbers(values: np.ndarray) -> list[float | None]:
    """Round ``values`` to four significant digits; None for values that are not finite."""
    return [float(f"{v:.4g}") if np.isfinite(v) else None for v in values]
