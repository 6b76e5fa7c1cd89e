"""Four frames of a scene: the full-order run, and below it each reduced run."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS
from pdrom.model.mesh.types import load_mesh
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera
from pdrom.report.figures.kit.floor import Floors
from pdrom.report.figures.kit.panels import RunPanel, shared_window
from pdrom.report.figures.kit.read import RerunInfo, positions_at, rerun_errors, rerun_infos
from pdrom.report.figures.kit.run_rows import Row, draw_rows, run_panel
from pdrom.report.scenes.picture import write_picture
from pdrom.report.scenes.results import SceneResults
from pdrom.report.scenes.sizes import shown

INSTANTS = (0.25, 0.5, 0.75, 1.0)  # of the run
CAMERA = Camera(30.0, 20.0)
NO_LIMIT = 100.0  # inches: the picture need not fit on a page


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the picture."""
    write_picture(draw, results, "frames", outputs)


def draw(results: SceneResults) -> Figure:
    """One row per run; the grey outline in the rows of reduced runs is the full-order run.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    scene, floors = results.scene, Floors(results)
    frames, full = positions_at(results.path(FULL_ORDER, scene), INSTANTS)
    instants = [floors.instant(scene, frame) for frame in frames]
    reference = [
        RunPanel(when, style.FULL_ORDER, q, reference=True).seen_by(CAMERA)
        for when, q in zip(instants, full, strict=True)
    ]
    reduced = {
        f"{style.words(group)}\n{results.method_title(method)}\nr = {info.r}": (
            _panels(results, group, method, info, frames)
        )
        for group, method in results.reductions
        if (info := shown(rerun_infos(results.path(RERUNS, scene, group, method)))) is not None
    }
    every = [reference, *reduced.values()]
    windows = [
        shared_window(CAMERA, q, [panels[i] for panels in every]) for i, q in enumerate(full)
    ]
    mesh = load_mesh(results.path(MESH, scene))
    rows = [Row(f"{style.words(scene)}\nfull order", mesh, reference, windows, full)]
    rows += [Row(label, mesh, panels, windows, full) for label, panels in reduced.items()]
    return draw_rows(rows, CAMERA, NO_LIMIT)


def _panels(
    results: SceneResults, group: str, method: str, info: RerunInfo, frames: Sequence[int]
) -> list[RunPanel]:
    path = results.path(RERUNS, results.scene, group, method)
    colour = style.surface_colour(style.group_looks(results.holdings)[group][0])
    errors = rerun_errors(path, info)
    panels = []
    for frame in frames:
        panel = run_panel(path, info, frame, colour, "").seen_by(CAMERA)
        if not panel.failure and frame and np.isfinite(errors[frame - 1]):
            panel = replace(panel, remark=f"relative error {errors[frame - 1]:.1g}")
        panels.append(panel)
    return panels
