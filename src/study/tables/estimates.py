"""Table estimates: errors of runs as the auxiliary model estimates them, beside the true ones."""

import pandas as pd

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import compared, flag, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.reruns import KEYS
from study.tables.kit.vocabulary import ERROR_WITHIN, GROUP, METHOD, POSITION_BASIS, SCENE, K, R

BAND = (0.3, 3.0)  # estimates between these multiples of the error count as good
MARGIN = 1.5  # an estimate above this multiple of the auxiliary model's own error is resolved


@table(
    title="Estimated and true errors of runs",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        POSITION_BASIS,
        K,
        R,
        text("split", f"motion of the run: train, {', '.join(MOTIONS)}"),
        ERROR_WITHIN,
        compared(
            "error",
            number(
                "estimate",
                "distance to the auxiliary model, relative to its motion, before the horizon",
            ),
        ),
        compared(
            "error",
            number(
                "largest_estimate", "largest one while it runs, over the motion of the training run"
            ),
        ),
        compared("error", number("ratio", "effectivity: estimate over error")),
        compared("error", flag("within", f"the ratio lies between {BAND[0]:g} and {BAND[1]:g}")),
        number("companion_error", "error of the auxiliary model's own run before the horizon"),
        compared(
            "error", number("floor", "the same of the training motion, which is known offline")
        ),
        compared("error", flag("resolved", f"the estimate exceeds {MARGIN:g} times the floor")),
        timed(number("overhead", "time of the auxiliary model's frame over that of the run")),
        timed(number("full_order_share", "the same over that of the full-order run")),
    ),
    reads={
        "parts": Every(paths.ESTIMATES),
        "times": Every(paths.COMPANION_TIMES),
        "reruns": TableOf("reduced_reruns"),
    },
)
def estimates(parts: list[File], times: list[File], reruns: pd.DataFrame) -> pd.DataFrame:
    """One row of ``parts`` per run with kept positions; no error where it ended before the horizon.

    A resolved estimate differs from the error by at most the auxiliary model's own error over the
    motion: if that is no larger than ``floor``, the ratio lies between 0.6 and 3.
    """
    rows = joined(parts)
    if rows.empty:
        return rows
    error = rows.relative_error_within_horizon.astype(float)
    rows["ratio"] = rows.estimate / error.where(error > 0.0)
    rows["within"] = rows.ratio.between(*BAND).where(rows.ratio.notna())
    train = rows[rows.split == "train"].groupby("scene").companion_error.first()
    rows["floor"] = rows.scene.map(train)
    rows["resolved"] = rows.estimate > MARGIN * rows.floor
    own = joined(times).set_index("scene")
    companion = rows.scene.map(own.companion_ms)
    rows["overhead"] = companion / _times_of(rows, reruns)
    rows["full_order_share"] = companion / rows.scene.map(own.full_ms)
    return rows


def _times_of(rows: pd.DataFrame, reruns: pd.DataFrame) -> pd.Series:
    """Time of a frame of each run: that of the training motion with the same model."""
    whole = {"k": "Int64", "r": "Int64"}
    known = reruns[[*KEYS, "ms_per_frame"]].astype(whole).drop_duplicates(KEYS)
    found = rows[KEYS].astype(whole).merge(known, on=KEYS, how="left").ms_per_frame
    return found.astype(float).set_axis(rows.index)
