"""Tables of the speed-up of reductions: local steps alone, and accurate runs."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.reads import Every, TableOf
from study.tables.accuracy_cost import FEWER
from study.tables.kit.declaration import count, integer, number, shared, table, timed
from study.tables.kit.results import FAILED, HIGH, LOW, MEDIAN, joined, trained, with_held_out

# Columns that identify a curve, the rows that differ only in size r.
CURVE = ["scene", "group", "method", "factor"]
OWN_MESH = "1"  # mesh factor of a scene's configured mesh, which the files ``own`` contain
SHARE = 1e-3  # of the force of a scene, up to which a group counts for nothing
_ERROR = "relative_error_within_horizon"


@table(
    title="Reduced local steps against the full one, and where they stop paying",
    columns=(
        *shared("scene group method"),
        number("factor", "on the vertices along a side of the scene's own mesh", compared="exact"),
        *shared("vertices elements r"),
        timed(number("local_ms", "time of the reduced local step", "ms")),
        timed(number("full_ms", "time of the full local step of the group", "ms")),
        timed(number("ratio", "the first over the second")),
        timed(integer("breakeven_r", "size from which the reduction costs more, of the curve")),
        timed(number("solve_ms", "of it, the solve of size r for the coefficients", "ms")),
        timed(number("lift_ms", "of it, the reconstruction from the coefficients", "ms")),
        timed(number("solve_ratio", "the solve alone over the full local step")),
        timed(number("lift_ratio", "the reconstruction alone over the full local step")),
    ),
    reads={"own": Every(paths.BREAK_EVEN), "sized": Every(paths.BREAK_EVEN_SIZED)},
)
def breakeven(own: list[paths.File], sized: list[paths.File]) -> pd.DataFrame:
    """One row per size r of each curve (see `CURVE`), with local-step times and break-even size.

    Files ``own`` are for the configured mesh of each scene, ``sized`` for other mesh sizes.

    ``breakeven_r`` is one value per curve. It is empty if the reduction is still faster at the
    largest size (the numerical rank), and the smallest size tried if it is never faster.
    """
    rows = joined([*own, *(file for file in sized if file["factor"] != OWN_MESH)])
    if rows.empty:
        return rows
    for part, name in (("local", "ratio"), ("solve", "solve_ratio"), ("lift", "lift_ratio")):
        rows[name] = rows[f"{part}_ms"] / rows.full_ms
    sizes = [
        pd.Series(break_even(*curve.sort_values("r")[["r", "ratio"]].to_numpy().T), curve.index)
        for _, curve in rows.groupby(CURVE, sort=False)
    ]
    return rows.assign(breakeven_r=pd.concat(sizes))


def break_even(r: Sequence[int], ratio: Sequence[float]) -> int | None:
    """Smallest size from which on the reduced local step costs at least as much as the full one.

    The ratio is interpolated linearly between the last size with a ratio below one and the next.
    None if the ratio is below one at the largest size; the smallest size if it never is below.

    Parameters
    ----------
    r : sizes, ascending
    ratio : time of the reduced local step over that of the full one, at each size
    """
    sizes, values = np.asarray(r, dtype=float), np.asarray(ratio, dtype=float)
    below = np.flatnonzero(values < 1.0)
    if len(below) == 0:
        return int(sizes[0])
    last = below[-1]
    if last == len(values) - 1:
        return None
    (a, b), (low, high) = sizes[last : last + 2], values[last : last + 2]
    return int(np.ceil(a + (b - a) * (1.0 - low) / (high - low) - 1e-9))


@table(
    title="Where reductions pay and where they lose to the full order",
    columns=(
        *shared("position_basis method"),
        count("scenes", "scenes (and groups) with a timed run"),
        count("accurate", "those with a run whose error before the horizon is at most a tenth"),
        timed(integer("pays", "those among them with an accurate run faster than the full order")),
        timed(integer("loses", "those whose accurate runs are all slower")),
        timed(number("best_speedup", "median over them of the fastest accurate run's speed-up")),
        timed(number("least_speedup", "the smallest of them")),
        timed(number("most_speedup", "the largest of them")),
        timed(number("error_train", "median error of these fastest runs on the training motion")),
        timed(
            number(
                "error_heldout",
                "median of their errors on held-out motions, of each the median over its motions",
            )
        ),
        timed(integer("heldout", "runs that had a held-out motion")),
        timed(number("error_heldout_low", "median of the least error of each over its motions")),
        timed(number("error_heldout_high", "median of the largest")),
        count(
            "accurate_heldout",
            "scenes (and groups) whose most accurate size on the training motion has at most a "
            "tenth held out",
        ),
        timed(integer("pays_heldout", "those that pay whose run has at most a tenth held out")),
    ),
    reads={
        "reruns": TableOf("reduced_reruns"),
        "points": TableOf("accuracy_cost"),
        "effects": TableOf("effects_cost"),
    },
)
def payoff(reruns: pd.DataFrame, points: pd.DataFrame, effects: pd.DataFrame) -> pd.DataFrame:
    """One row per position basis and method, over all scenes and sizes that ran and were timed.

    Sizes are chosen by the training motion in the table ``reruns`` and evaluated on the held-out
    motions, see `with_held_out`. Groups with at most `SHARE` of the force of a scene are left out.
    The first row is the full order with fewer iterations (of ``points``), against the same run of
    the scene as all reductions; it needs no training, and nothing is held out from it.
    """
    shares = effects.set_index(["scene", "effect"]).force_share
    weak = shares.index[shares <= SHARE]
    runs = trained(reruns)
    runs = runs[runs.speedup.notna() & runs.max_extent.notna()]
    runs = runs[~pd.MultiIndex.from_frame(runs[["scene", "group"]]).isin(weak)]
    runs = pd.concat([_fewer(points), with_held_out(runs, reruns)], ignore_index=True)
    rows = []
    for (basis, method), own in runs.groupby(["position_basis", "method"], sort=False):
        accurate = own[own[_ERROR] <= FAILED]
        fastest = accurate.sort_values("speedup").groupby(["scene", "group"]).tail(1)
        speed = fastest.speedup.to_numpy(float)
        best = own.sort_values(_ERROR, kind="stable").groupby(["scene", "group"]).head(1)
        seen = best[best.error_heldout.notna()]
        rows.append({
            "position_basis": basis,
            "method": method,
            "scenes": own.groupby(["scene", "group"]).ngroups,
            "accurate": len(fastest),
            "pays": int(np.sum(speed > 1.0)),
            "loses": int(np.sum(speed <= 1.0)),
            "best_speedup": fastest.speedup.median(),
            "least_speedup": fastest.speedup.min(),
            "most_speedup": fastest.speedup.max(),
            "error_train": fastest[_ERROR].median(),
            "error_heldout": fastest.error_heldout.median(),
            "heldout": int(fastest.error_heldout.notna().sum()),
            "error_heldout_low": fastest.error_heldout_low.median(),
            "error_heldout_high": fastest.error_heldout_high.median(),
            "accurate_heldout": int((seen.error_heldout <= FAILED).sum()),
            "pays_heldout": int(np.sum((speed > 1.0) & (fastest.error_heldout <= FAILED))),
        })  # fmt: skip
    return pd.DataFrame(rows)


def _fewer(points: pd.DataFrame) -> pd.DataFrame:
    """Full-order runs with fewer iterations, with their speed-ups over those of the scenes."""
    full = points[(points.method == "full") & (points.position_basis == "full")]
    fewer = points[points.method == FEWER]
    speedup = fewer.scene.map(full.set_index("scene").ms_per_frame) / fewer.ms_per_frame
    unseen = dict.fromkeys((MEDIAN, LOW, HIGH), np.nan)
    return fewer.assign(group="all", speedup=speedup, **unseen)
