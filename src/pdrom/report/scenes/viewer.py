"""The runs of a scene, or of several, as a page to look at them."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from pdrom.core.paths import FULL_ORDER, MESH, RERUNS, TIMINGS
from pdrom.core.store import open_hdf5, read_table
from pdrom.model.mesh.types import load_mesh
from pdrom.report.figures.kit.floor import Floors
from pdrom.report.figures.kit.read import choose_ranks, rerun_infos
from pdrom.report.scenes.loaded import load_run
from pdrom.report.scenes.results import SceneResults
from pdrom.report.viewer.page import write_page
from pdrom.report.viewer.runs import ViewedRun, ViewedScene

TIMED = ["group", "method", "position_basis", "r", "implementation", "ms_per_frame"]


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the page of one scene, whose reduced runs need not be timed."""
    write_page([viewed(results, pd.DataFrame(columns=TIMED))], outputs["page"])


def make_index(scenes: Sequence[SceneResults], page: str) -> None:
    """Write the page of several scenes with the times of their runs."""
    timed = [read_table(r.path(TIMINGS, r.scene), TIMED) for r in scenes]
    write_page([viewed(r, times) for r, times in zip(scenes, timed, strict=True)], page)


def viewed(results: SceneResults, times: pd.DataFrame) -> ViewedScene:
    """A scene with its runs; ``times`` are rows of its timing table.

    Raises
    ------
    StorageError
        A file of the results is missing or damaged.
    """
    scene, floors = results.scene, Floors(results)
    with open_hdf5(results.path(FULL_ORDER, scene)) as file:
        positions, own = file["positions"][...], float(np.median(file["timings"][...].sum(axis=1)))
    compiled = times[times.method.isna() & (times.implementation == "compiled")]
    return ViewedScene(
        name=scene,
        title=results.title or scene.replace("_", " "),
        mesh=load_mesh(results.path(MESH, scene)),
        time_step=results.settings["time_step"],
        positions=positions,
        ms=float(compiled.ms_per_frame.iloc[0]) if len(compiled) else own,
        floor=floors.of(scene),
        horizon=floors.horizon(scene),
        runs=tuple(_runs(results, times[times.position_basis.isna()])),
        effects=results.effects,
    )


def _runs(results: SceneResults, times: pd.DataFrame) -> Iterator[ViewedRun]:
    for group, method in results.reductions:
        path = results.path(RERUNS, results.scene, group, method)
        for info in choose_ranks(rerun_infos(path), results.ranks):
            if info.marked or not info.entries:
                continue
            run = load_run(path, group, method, info)
            same = (times.group == group) & (times.method == method) & (times.r == info.r)
            yield ViewedRun(
                group=group,
                method=results.method_title(method),
                r=info.r,
                positions=run.positions,
                error=run.error,
                blowup_frame=info.blowup_frame if info.blowup_frame >= 0 else None,
                ms=float(times.ms_per_frame[same].iloc[0]) if same.any() else None,
            )
