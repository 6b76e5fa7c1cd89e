"""Table local_share: what part of a full-order frame the local step takes (claim C1)."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import number, table, text, timed
from study.tables.kit.parts import timings_in_one_time
from study.tables.kit.vocabulary import GLOBAL_MS, LOCAL_MS, LOCAL_SHARE, SCENE, VERTICES

IMPLEMENTATIONS = ("interpreted", "numpy", "compiled")


@table(
    title="Share of the local step in a full-order frame",
    columns=(
        SCENE,
        text("implementation", f"of the local step: {', '.join(IMPLEMENTATIONS)}"),
        VERTICES,
        LOCAL_MS,
        timed(number("assembly_ms", "time of the right-hand side in a frame", "ms")),
        GLOBAL_MS,
        LOCAL_SHARE,
    ),
    reads={"timings": Every(paths.TIMINGS), "frame_times": TableOf("frame_times")},
)
def local_share(timings: list[File], frame_times: pd.DataFrame) -> pd.DataFrame:
    """One row per scene and implementation of ``timings``, in the time of ``frame_times``.

    Assembly counts as a part of the local step: compiled kernels project and scatter in one pass.
    """
    times = timings_in_one_time(timings, frame_times)
    full = times[times.method.isna()].copy()
    full["local_share"] = (full.local_ms + full.assembly_ms) / (
        full.local_ms + full.assembly_ms + full.global_ms
    )
    order = {name: place for place, name in enumerate(IMPLEMENTATIONS)}
    scenes = {scene: place for place, scene in enumerate(times.scene.unique())}
    keys = full.scene.map(scenes) * len(order) + full.implementation.map(order)
    return full.iloc[keys.argsort(kind="stable")]
