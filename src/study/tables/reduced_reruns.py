"""Table reduced_reruns: errors of the reruns, over the run and within the horizon, with times."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.tables.kit.declaration import table
from study.tables.kit.one_time import timings_in_one_time
from study.tables.kit.reruns import COLUMNS, KEYS, MEASURES, TRAIN, judged_reruns
from study.tables.kit.vocabulary import GLOBAL_MS, LOCAL_MS, MS_PER_FRAME, SPEEDUP


@table(
    title="Reduced runs of the training motions",
    columns=(*COLUMNS, MS_PER_FRAME, LOCAL_MS, GLOBAL_MS, SPEEDUP, *MEASURES),
    reads={
        "runs": Every(paths.RERUNS),
        "rows": Every(paths.RERUNS_TRAIN),
        "subspaces": Every(paths.SUBSPACES),
        "subspace_rows": Every(paths.SUBSPACES_TRAIN),
        "timings": Every(paths.TIMINGS),
        "frame_times": TableOf("frame_times"),
        "sensitivity": TableOf("sensitivity"),
        "perturbation": Setting("sensitivity.reference"),
        "threshold": Setting("sensitivity.threshold"),
    },
)
def reduced_reruns(
    runs: list[File],
    rows: list[File],
    subspaces: list[File],
    subspace_rows: list[File],
    timings: list[File],
    frame_times: pd.DataFrame,
    sensitivity: pd.DataFrame,
    perturbation: float,
    threshold: float,
) -> pd.DataFrame:
    """Runs of the training motion with their times; see `judged_reruns` for the rest."""
    judged = judged_reruns(
        runs,
        rows,
        subspaces,
        subspace_rows=subspace_rows,
        sensitivity=sensitivity,
        perturbation=perturbation,
        threshold=threshold,
        motion=TRAIN,
    )
    return _with_times(judged, timings_in_one_time(timings, frame_times))


def _with_times(runs: pd.DataFrame, times: pd.DataFrame) -> pd.DataFrame:
    """``runs`` with the times of each row; the speed-up is against the compiled full order."""
    full = times[times.method.isna() & (times.implementation == "compiled")]
    reference = full.set_index("scene").ms_per_frame
    reduced = times[times.method.notna()].copy()
    reduced["position_basis"] = reduced.position_basis.fillna("full")
    reduced["local_ms"] += reduced.assembly_ms + reduced.lift_ms
    reduced["speedup"] = reduced.scene.map(reference) / reduced.ms_per_frame
    measured = ["ms_per_frame", "local_ms", "global_ms", "speedup"]
    inside = reduced.position_basis != "full"
    keys = [k for k in KEYS if k != "k"]
    local = runs[runs.position_basis == "full"].merge(
        reduced.loc[~inside, keys + measured], on=keys, how="left"
    )
    # the timing of a subspace model is found by its size k, its r is the element count
    keys = [k for k in KEYS if k != "r"]
    subspace = runs[runs.position_basis != "full"]
    if len(subspace) == 0:
        return local
    times_inside = reduced.loc[inside, keys + measured].astype({"k": "int64"})
    subspace = subspace.astype({"k": "int64"}).merge(times_inside, on=keys, how="left")
    return pd.concat([local, subspace], ignore_index=True)
