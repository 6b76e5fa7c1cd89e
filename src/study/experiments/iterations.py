"""Compare runs with K local/global iterations per frame with the limit K -> infinity.

The runs are on the scene's mesh and on coarser meshes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated

import pandas as pd
from pydantic import Field

from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.coarser import Coarser, error_of_mesh, grids
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.settings import (
    ANDERSON,
    COARSER_ANDERSON,
    PLAIN,
    Setting,
    full_order,
)
from study.artifact import paths
from study.artifact.reads import Setting as Configured
from study.experiments.kit import base as kit
from study.experiments.references import converged_positions

COLUMNS = [
    "scene", "iterations", "window", "vertices", "frames", "error_converged",
    "deformation_converged", "mesh_error",
]  # fmt: skip
NAMES = {PLAIN: kit.FOM, ANDERSON: kit.ANDERSON}  # names of methods in tables of the study
COARSE, MOST = 1e-6, 4000  # converged runs on coarser meshes: tolerance, most evaluations a frame


class IterationCounts(ConfigModel):
    """Section ``iterations``: full-order settings other than that of the scene.

    counts, coarser_counts : local/global iterations of a frame, on the scene's and coarser meshes
    anderson_window : numbers of iterations above 2 are also run with this window, unless it is 0
    coarser : numbers of cells along a side of coarser meshes, relative to the scene's mesh
    """

    counts: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = (1, 2, 5, 10, 20, 40)
    coarser_counts: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = (2, 5, 10)
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 5
    coarser: kit.Parts = kit.PARTS


@kit.experiment(
    "Errors of {scene} for several numbers of iterations",
    reads={
        "mesh": paths.MESH,
        "converged": paths.CONVERGED.where(run="train"),
        "sensitivity": paths.SENSITIVITY,
        "config": Configured("scene"),
        "asked": Configured("iterations"),
        "horizon": Configured("horizon"),
    },
    writes={"out": paths.ITERATIONS},
)
def iterations(
    config: SceneConfig, asked: IterationCounts, horizon: kit.Horizon, out: paths.File,
    **files: paths.File,
) -> None:  # fmt: skip
    """Run a scene with every setting until its horizon; write errors against the converged run.

    The errors are empty if no run converged. The scene's setting also gets the error of the mesh.
    """
    scene = kit.scene_of(config, files["mesh"])
    frames = max(1, horizon.frames(files["sensitivity"]))
    scene = scene.changed(frames=frames)
    limit = converged_positions(files["converged"], frames)
    truth, rows = None if limit is None else Yardstick(scene, limit), []
    for setting in settings(scene, asked):
        row = {"scene": config.name, "frames": frames, **setting.labels}
        accelerates = setting.labels["method"] in (kit.ANDERSON, COARSER_ANDERSON)
        row["window"] = asked.anderson_window * accelerates
        if truth is not None:
            _, row["error_converged"], row["deformation_converged"] = setting.errors(truth)
        rows.append(row)
    coarser = grids(scene, asked.coarser)
    coarser = coarser[:: max(1, len(coarser) - 1)]
    runs = [mesh.converged(COARSE, MOST) for mesh in coarser]
    table = pd.DataFrame(rows, columns=COLUMNS)
    own = (table.iterations == config.iterations) & (table.window == 0)
    table.loc[own & (table.vertices == scene.mesh.vertices), "mesh_error"] = error_of_mesh(
        limit, coarser, runs
    )
    write_table(table, out.path)


def settings(scene: Scene, asked: IterationCounts) -> Iterator[Setting]:
    """Yield full-order settings of ``scene`` with all numbers of iterations, on all meshes."""
    coarse = grids(scene, asked.coarser)
    counts = sorted({*asked.counts, scene.config.count}), sorted(asked.coarser_counts)
    places: tuple[Sequence[Coarser | None], ...] = ((None,), coarse)
    for meshes, numbers in zip(places, counts, strict=True):
        pairs = accelerated(numbers, asked.anderson_window)
        for each in full_order(scene, pairs, meshes):
            method = each.labels["method"]
            yield replace(each, labels={**each.labels, "method": NAMES.get(method, method)})


def accelerated(counts: list[int], window: int) -> list[tuple[int, int]]:
    """Return pairs (iterations, Anderson window): ``counts`` with 0, those above 2 with window."""
    plain = [(count, 0) for count in counts]
    return plain + [(count, window) for count in counts if window and count > 2]
