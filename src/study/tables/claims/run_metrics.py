"""Metrics of claims about reduced runs: a number for each chosen run, with its labels.

A metric gets ``tables`` by name, values that ``where`` allows in columns of theirs, and the largest
error of an accurate run, ``accuracy``.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd

from study.tables.claims.rows import VALUE, Tables, filtered, labelled
from study.tables.kit.families import families
from study.tables.kit.held_out import MEDIAN, trained, with_held_out

Values = Callable[[Tables, dict, float], pd.DataFrame]


def _full_rank_only(table: pd.DataFrame, where: dict) -> tuple[pd.DataFrame, dict]:
    """Handles ``r: [full]``: the largest size tried for each scene, group and method.

    A run that blew up before its first frame was tried, too: leaving it out would put a smaller
    size, which survived, in the place of full rank.
    """
    if "r" not in where or "full" not in where["r"]:
        return table, where
    ran = _tried(table)
    largest = ran.groupby(["scene", "group", "method"]).r.transform("max")
    return ran[ran.r == largest], {k: v for k, v in where.items() if k != "r"}


def _reruns(tables: Tables, where: dict) -> pd.DataFrame:
    """Reruns of the training motion; with reduced positions only if ``where`` selects them.

    A method may have the same name with full and with reduced positions.
    """
    table = trained(tables["reduced_reruns"])
    return table if "position_basis" in where else table[table.position_basis == "full"]


def _tried(rows: pd.DataFrame) -> pd.DataFrame:
    """Reruns that started: not the marked ones, whose size exceeds the numerical rank."""
    return rows[(rows.frames > 0) | rows.blowup_frame.notna()]


def held_out(values: Values) -> Values:
    """``values`` of the same runs with their median error over held-out motions.

    Runs without a held-out motion that can be judged are left out. Times are the training run's.
    """

    def of_held_out(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
        reruns = tables["reduced_reruns"]
        runs = with_held_out(trained(reruns), reruns)
        runs = runs[runs[MEDIAN].notna()].assign(relative_error_within_horizon=runs[MEDIAN])
        return values({**tables, "reduced_reruns": runs}, where, accuracy)

    return of_held_out


def rerun_error(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error within the horizon; a run that blew up before its horizon counts as infinite."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    rows = _tried(filtered(table, where))
    return labelled(rows, rows.relative_error_within_horizon.fillna(np.inf))


def useful_speedup(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Speed-up over the full-order run; 0 for a run that is not accurate."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    rows = _tried(filtered(table, where))
    accurate = rows.relative_error_within_horizon <= accuracy
    return labelled(rows, rows.speedup.where(accurate, 0.0)).dropna(subset=[VALUE])


def best_useful_speedup(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """The largest useful speed-up over sizes and methods, per scene and group."""
    runs = useful_speedup(tables, where, accuracy)
    return runs.groupby(["scene", "group"], sort=False)[VALUE].max().reset_index()


def error_trend(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Spearman's rank correlation of error and size, per scene, group and method.

    1 where the error rises with every size, -1 where it falls; blow-ups share the highest rank.
    Fewer than three sizes have no trend; errors that are all equal have the trend 0.
    """
    rows = _tried(filtered(_reruns(tables, where), where))
    trends = []
    for labels, run in rows.groupby(["scene", "group", "method"], sort=False):
        error = run.relative_error_within_horizon.fillna(np.inf)
        if len(run) >= 3:
            trend = 0.0 if error.nunique() == 1 else error.rank().corr(run.r.rank())
            trends.append((*labels, trend))
    return pd.DataFrame(trends, columns=["scene", "group", "method", VALUE])


def trend_p_value(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """P-value of Page's test (1963) that errors rise with the sizes, over families of scenes.

    The places of the sizes of an experiment (scene, group, method) in ascending order are the
    treatments, and blow-ups share the highest rank of its errors. A scene, its twin and the methods
    on both are no independent observations: the mean ranks of a family's experiments are one block.
    Experiments with the most common number of sizes count; one value, or none with fewer than two
    blocks of three sizes.
    """
    rows = _tried(filtered(_reruns(tables, where), where))
    return _page(rows, "relative_error_within_horizon")


def repeated_trend_p_value(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """p-value of the trend of the medians over repetitions, as one run may rise by chance."""
    return _page(filtered(tables["repetitions"], where), "error_median")


def _page(rows: pd.DataFrame, error: str) -> pd.DataFrame:
    """One p-value, or no row with fewer than two blocks of three sizes."""
    runs = [
        run for _, run in rows.sort_values("r").groupby(["scene", "group", "method"], sort=False)
    ]
    lengths = [len(run) for run in runs]
    common = max(set(lengths), key=lambda n: (lengths.count(n), n), default=0)
    # imported here: at the top it would cost a second of every plan
    from scipy.stats import page_trend_test, rankdata

    ranks: dict[str, list[np.ndarray]] = {}
    for run in (run for run in runs if len(run) == common):
        ranked = run[error].rank(na_option="bottom").to_numpy(float)
        ranks.setdefault(families(run.scene).iloc[0], []).append(ranked)
    if len(ranks) < 2 or common < 3:
        return pd.DataFrame(columns=[VALUE])
    blocks = [rankdata(np.mean(own, axis=0)) for own in ranks.values()]
    return pd.DataFrame({VALUE: [float(page_trend_test(blocks, ranked=True).pvalue)]})


def noise_error(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error of runs on bases of round-off; infinite where a run ends early or cannot start."""
    rows = filtered(tables["noise"], where)
    rows = rows[rows.r <= rows["rank"]]
    return labelled(rows, rows.relative_error.fillna(np.inf))


def position_basis_ratio(tables: Tables, where: dict, accuracy: float) -> pd.DataFrame:
    """Error of the snapshot basis over that of the skinning basis at equal k, per scene.

    Only where at least one of the two is accurate: the better of two failures says nothing.
    """
    rows = filtered(trained(tables["reduced_reruns"]), where)
    keys = ["scene", "k"]
    errors = {
        kind: rows[rows.position_basis == kind].set_index(keys).relative_error_within_horizon
        for kind in ("pod", "skinning")
    }
    both = pd.DataFrame(errors).dropna()
    both = both[both.min(axis=1) <= accuracy]
    return both.assign(**{VALUE: both["pod"] / both["skinning"]})[[VALUE]].reset_index()
