"""Table alarms: what tells failing runs from good ones while they run, without the full order."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from pdrom.artifact.reads import Every, Setting, TableOf
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.model.held_out import FIRST
from pdrom.tables.gain_prediction import FAILED
from pdrom.tables.kit.declaration import compared, integer, number, table, text
from pdrom.tables.kit.parts import joined

_KEYS = ["scene", "group", "method", "r"]


@table(
    title="Alarms at run time: failures noticed, and false alarms",
    columns=(
        text("split", "motion of the runs: train, heldout"),
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
    """For each motion a row for the alarm of the reruns' guard and one for the estimate.

    Both count the same runs. The ``estimates`` are those of the runs as they are, frame by frame.

    Parameters
    ----------
    estimates, reruns, heldout : tables estimates, reduced_reruns and heldout_reruns
    guarded, guarded_heldout : tables of the reruns, with what their guard saw
    threshold, alarm : of that guard
    """
    rows: list[dict[str, Any]] = []
    for split, runs, files in (
        ("train", reruns, guarded),
        (FIRST, heldout[heldout.motion == FIRST], guarded_heldout),
    ):
        watched = joined(files)
        own = watched if watched.empty else watched[watched.guard_count.notna()]
        own = own[own.motion == FIRST] if split == FIRST and len(own) else own
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
    own = estimates[(estimates.split == split) & (estimates.position_basis == "full")]
    own = own[[*_KEYS, "largest_estimate"]].astype({"r": "int64"})
    if own.empty or guarded.empty:
        return
    ends = runs.drop_duplicates("scene").set_index("scene").horizon_frame
    table = guarded[[*_KEYS, "relative_error", "guard_frame"]].astype({"r": "int64"})
    judged = runs[[*_KEYS, "position_basis", "relative_error_within_horizon"]]
    judged = judged[judged.position_basis == "full"].astype({"r": "int64"})
    table = table.merge(judged, on=_KEYS).merge(own, on=_KEYS)
    table = table[table.scene.map(ends) > 0]
    failed = ~(table.relative_error_within_horizon <= FAILED)
    noticed = table.guard_frame.astype(float) < table.scene.map(ends)
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
