"""Table breakeven: reduced local steps over the full one, and where they stop paying."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import ELEMENTS, GROUP, METHOD, SCENE, VERTICES, R

# What the sizes r of one line of the table have in common.
CURVE = ["scene", "group", "method", "factor"]
OWN_MESH = "1"  # factor of a scene's own mesh, whose curve is measured with its other timings


@table(
    title="Reduced local steps against the full one, and where they stop paying",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        compared("exact", number("factor", "on the vertices along a side of the scene's own mesh")),
        VERTICES,
        ELEMENTS,
        R,
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
def breakeven(own: list[File], sized: list[File]) -> pd.DataFrame:
    """One row per size; ``breakeven_r`` belongs to a whole curve, see `CURVE`.

    Scenes have their ``own`` mesh and those of other sizes, ``sized``.

    It is empty where the reduction still pays at the largest size, the numerical rank, and the
    smallest size tried where it never pays.
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
    """Smallest size from which the reduced local step costs as much as the full one, for good.

    Between the last size below one and the first above it the ratio is interpolated linearly.
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
