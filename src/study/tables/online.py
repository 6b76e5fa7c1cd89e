"""Table online: large hyper-reduced scenes, one row per scene, basis, size and tolerance."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import compared, integer, number, table, timed
from study.tables.kit.parts import joined
from study.tables.kit.reruns import HIGH, LOW, MEDIAN, TRAIN
from study.tables.kit.vocabulary import (
    ELEMENTS_SAMPLED,
    MS_PER_FRAME,
    POSITION_BASIS,
    SCENE,
    SPEEDUP,
    SPEEDUP_HIGH,
    SPEEDUP_LOW,
    VERTICES,
    K,
)
from study.tables.speedups import large_errors, timed_reductions

_KEYS = ["scene", "position_basis", "k", "method"]
_ERRORS = {
    "error_train": "relative_error_train", MEDIAN: "relative_error_heldout",
    LOW: "relative_error_heldout_low", HIGH: "relative_error_heldout_high",
}  # fmt: skip
_TIMES = ["ms_per_frame", "fom_ms_per_frame", "speedup", "speedup_low", "speedup_high"]


@table(
    title="Large scenes in position subspaces with sampled elements",
    columns=(
        SCENE,
        VERTICES,
        integer("elements", "elements of all groups"),
        POSITION_BASIS,
        K,
        compared("exact", number("tau", "tolerance of the element sampling")),
        ELEMENTS_SAMPLED,
        number("relative_error_train", "error of the positions in the training motion"),
        number("relative_error_heldout", "the same in held-out motions: their median"),
        number("relative_error_heldout_low", "the least of them"),
        number("relative_error_heldout_high", "the largest"),
        MS_PER_FRAME,
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        timed(number("fom_ms_per_frame", "time of a frame of the full-order run", "ms")),
        SPEEDUP,
        SPEEDUP_LOW,
        SPEEDUP_HIGH,
    ),
    reads={
        "parts": Every(paths.ONLINE),
        "measured": Every(paths.FRAME_TIMES),
        "times": TableOf("frame_times"),
    },
)
def online(parts: list[File], measured: list[File], times: pd.DataFrame) -> pd.DataFrame:
    """Rows of all scenes, ``parts``, in order, with ``measured`` times, in the one of ``times``."""
    rows = joined(parts)
    if rows.empty:
        return rows
    found = pd.DataFrame(list(timed_reductions(joined(measured), times)))
    found = found.rename(columns={"full_ms": "fom_ms_per_frame"})
    made = rows[rows.motion == TRAIN].rename(columns={"r": "elements_sampled"})
    made = made.merge(large_errors(rows).rename(columns=_ERRORS), on=_KEYS, how="left")
    made = made.merge(found[[*_KEYS, *_TIMES]], on=_KEYS, how="left")
    return made.assign(ms_per_iteration=made.ms_per_frame / made.iterations)
