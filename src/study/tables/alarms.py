"""Table alarms: what tells failing runs from good ones while they run, without the full order."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.tables.gain_prediction import FAILED
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined

_KEYS = ["scene", "group", "method", "r", "motion"]
_ERROR = "relative_error_within_horizon"


@table(
    title="Alarms at run time: failures noticed, and false alarms",
    columns=(
        text(
            "split",
            "motion of the runs: train; heldout, which counts those of all held-out motions",
        ),
        text("alarm", "what gives it: trained-range, estimate"),
        compared("exact", number("threshold", "largest estimate that is no alarm")),
        compared("share", integer("runs", "runs with projections alone reduced")),
        compared(
            "share",
            integer("failed", f"runs among them that blow up or have an error above {FAILED:g}"),
        ),
        compared("share", number("detected_share", "failed runs with an alarm before the horizon")),
        compared("share", number("false_share", "other runs with an alarm before the horizon")),
    ),
    reads={
        "estimates": TableOf("estimates"),
        "reruns": TableOf("reduced_reruns"),
        "heldout": TableOf("heldout_reruns"),
        "guarded": Every(paths.RERUNS_TRAIN),
        "guarded_heldout": Every(paths.RERUNS_HELDOUT),
        "threshold": Setting("guard.threshold"),
        "alarm": Setting("guard.alarm"),
    },
)
def alarms(
    estimates: pd.DataFrame,
    reruns: pd.DataFrame,
    heldout: pd.DataFrame,
    guarded: list[File],
    guarded_heldout: list[File],
    threshold: float,
    alarm: str,
) -> pd.DataFrame:
    """For runs of the training and of held-out motions, a row for the reruns' guard and one for
    the estimate.

    Both count the same runs. The ``estimates`` are those of the runs as they are, frame by frame.

    Parameters
    ----------
    estimates, reruns, heldout : tables estimates, reduced_reruns and heldout_reruns
    guarded, guarded_heldout : tables of the reruns, with what their guard saw
    threshold, alarm : of that guard
    """
    seen = [joined(files) for files in (guarded, guarded_heldout)]
    if any(table.empty for table in seen):
        return pd.DataFrame()
    parts = {"train": (reruns.assign(motion="train"), seen[0].assign(motion="train"))}
    parts["heldout"] = (heldout, seen[1])
    rows: list[dict[str, Any]] = []
    for split, (runs, watched) in parts.items():
        own = watched[watched.guard_count.notna()]
        rows += _rows(split, runs, own, estimates, threshold, alarm)
    return pd.DataFrame(rows)


def _rows(
    split: str,
    runs: pd.DataFrame,
    guarded: pd.DataFrame,
    estimates: pd.DataFrame,
    threshold: float,
    alarm: str,
) -> Iterator[dict[str, Any]]:
    known, judged = (
        rows[rows.position_basis == "full"].astype({"r": "int64"})
        for rows in (estimates.rename(columns={"split": "motion"}), runs)
    )
    table = guarded[[*_KEYS, "relative_error", "guard_frame"]].astype({"r": "int64"})
    table = table.merge(judged[[*_KEYS, _ERROR, "horizon_frame"]], on=_KEYS)
    table = table.merge(known[[*_KEYS, "largest_estimate"]], on=_KEYS)
    table = table[table.horizon_frame > 0]
    if table.empty:
        return
    failed = ~(table[_ERROR] <= FAILED)
    noticed = table.guard_frame.astype(float) < table.horizon_frame
    # an estimate that is not finite is larger than any threshold
    estimated = ~(table.largest_estimate <= threshold)
    alarms = {alarm: (noticed, None), "estimate": (estimated, threshold)}
    for name, (given, value) in alarms.items():
        yield {
            "split": split,
            "alarm": name,
            "threshold": value,
            "runs": len(table),
            "failed": int(failed.sum()),
            "detected_share": given[failed].mean(),
            "false_share": given[~failed].mean(),
        }
