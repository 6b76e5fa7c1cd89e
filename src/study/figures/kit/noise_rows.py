"""Rows of runs on bases of round-off: one start drawn, all starts counted."""

from dataclasses import replace

import numpy as np
import pandas as pd

from pdrom.model.mesh.types import load_mesh
from pdrom.view import style
from pdrom.view.panels import RunPanel, shared_window
from pdrom.view.read import positions_at, rerun_infos
from pdrom.view.run_rows import Row, run_panel
from study.artifact.paths import FULL_ORDER, MESH, NOISE_RUNS
from study.figures.kit.floor import Floors
from study.figures.kit.legends import group_looks
from study.figures.kit.options import ReducedRuns
from study.figures.kit.results import Results

NOISY = {"all": "all axes", "plane": "in the plane", "vertex": "one vertex across"}
WRONG = 0.1  # of the motion: a run whose error is larger has failed, as one that does not start


def noise_rows(
    results: Results,
    options: ReducedRuns,
    floors: Floors,
    scene: str,
    group: str,
    table: pd.DataFrame,
) -> list[Row]:
    """A row per drawn method and kind of start; below each picture how many of all starts fail.

    Kinds of which as many fail at every size share a row, with a run of the first of them.

    Parameters
    ----------
    table : rows of the table ``noise`` of this scene and group
    """
    camera = options.camera
    colour = style.surface_colour(group_looks(results.holdings)[group][0])
    frames, full = positions_at(results.path(FULL_ORDER, scene), options.frames[-1:])
    mesh, path = load_mesh(results.path(MESH, scene)), results.path(NOISE_RUNS, scene, group)
    when = floors.instant(scene, frames[0]).replace(", ", "\n")
    reference = RunPanel("full order", style.FULL_ORDER, full[0], reference=True).seen_by(camera)
    rows = []
    for method in results.methods(options):
        for counts, kinds in _alike(table[table.method == method]).items():
            fail = dict(counts)
            panels = [
                replace(
                    run_panel(path, info, frames[0], colour=colour, title=info.title),
                    remark=fail[info.r],
                )
                for info in rerun_infos(path, f"{kinds[0]}/{method}")
                if info.r in fail
            ]
            panels = [panel.seen_by(camera) for panel in panels]
            label = f"{results.experiment_title(scene, group)}\n{results.method_title(method)}"
            start = ", ".join(NOISY[kind] for kind in kinds)
            rows.append(
                Row(
                    f"{label}\nnoise: {start}\n{when}",
                    mesh,
                    [reference, *panels],
                    [shared_window(camera, full[0], panels)] * (len(panels) + 1),
                    np.repeat(full, len(panels) + 1, axis=0),
                )
            )
    return rows


def _alike(table: pd.DataFrame) -> dict[tuple[tuple[int, str], ...], list[str]]:
    """(r, how many of all starts fail) of every size -> kinds of starts with these counts."""
    table = table[table.r <= table["rank"]]
    failed = ~(table.relative_error <= WRONG)
    kinds: dict[tuple[tuple[int, str], ...], list[str]] = {}
    for kind, of_kind in failed.groupby(table.noisy_axes, sort=False):
        sizes = of_kind.groupby(table.r)
        counts = ((int(r), f"{one.sum()} of {len(one)} starts fail") for r, one in sizes)
        kinds.setdefault(tuple(counts), []).append(str(kind))
    return kinds
