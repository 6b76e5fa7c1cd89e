"""Advice from tables: what to leave out of a scene, and what to take for an error and a time.

Nothing is computed here but comparisons; every number is one that was measured.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from pdrom.experiments.kit.names import ANDERSON, FOM
from pdrom.tables.accuracy_cost import CONVERGED, reference_of

SHOWN = 3  # choices that are named
ERROR, MS = "relative_error_within_horizon", "ms_per_frame"
FULL = "full"


def on_effects(contributions: pd.DataFrame) -> Iterator[str]:
    """Describe each effect of a scene, those below the floor first.

    Parameters
    ----------
    contributions : the scene's rows of the table effects_contribution, at least one
    """
    floor = float(contributions.sensitivity_floor.iloc[0])
    yield f"sensitivity floor {floor:.2g}: less cannot be told from round-off"
    idle = contributions[contributions.above_floor.eq(False).fillna(False)]
    for row in idle.itertuples():
        why = "exerts no force" if row.acting_frames == 0 else f"moves the run by {row.moved:.2g}"
        yield f"  {row.effect}: {why}, never above the floor; {_saving(row)}"
    if not len(idle):
        yield "  every effect that can be left out acts above the floor"
    acting = contributions.drop(idle.index)
    kept = [
        row.effect if pd.isna(row.moved) else f"{row.effect} ({row.moved:.2g})"
        for row in acting.sort_values("moved", ascending=False, na_position="first").itertuples()
    ]
    yield f"  needed, with how far the run moves without: {', '.join(kept)}"


def _saving(row: object) -> str:
    saved, own = getattr(row, "saved_ms", np.nan), getattr(row, "own_ms", np.nan)
    if not pd.isna(saved):
        return f"without it a frame takes {max(saved, 0.0):.2g} ms less (it costs {own:.2g})"
    return "no time of it was measured" if pd.isna(own) else f"it costs {own:.2g} ms a frame"


def on_choices(
    points: pd.DataFrame, error: float | None, ms: float | None
) -> tuple[list[str], bool]:
    """Settings that keep an error and a time, and whether there is one.

    Parameters
    ----------
    points : the scene's rows of the table accuracy_cost
    error : largest relative error allowed; None: any
    ms : longest time of a frame allowed; None: any
    """
    converged = reference_of(points) == CONVERGED
    lines, fits = [], False
    for title, rows in (
        ("iterations K (error against the converged steps)", points[converged]),
        ("reduction (error against the scene's own full-order run)", points[~converged]),
    ):
        found, fit = _fitting(rows, error, ms)
        lines += [f"{title}:", *(f"  {line}" for line in found)]
        fits = fits or fit
    return lines, fits


def on_asks(rows: pd.DataFrame) -> tuple[list[str], bool]:
    """Outcome of ``pdrom reduce --error`` on motions of a scene, and whether all kept it.

    Parameters
    ----------
    rows : the scene's rows of the table asks, at least one, with asks that are small enough; those
        with the largest of them count
    """
    own = rows[rows.asked == rows.asked.max()]
    kept = own[own.promised.astype(bool)]
    lines = [f"pdrom reduce --error {own.asked.iloc[0]:g}, tried on {len(own)} held-out motions:"]
    for step, part in kept.groupby("last_step", sort=False):
        lines.append(
            f"  {step}: error {_span(part.error)}, {_span(part[MS])} ms a frame, full order "
            f"{_span(part.full_ms)} ({len(part)} of {len(own)} motions)"
        )
    if len(kept) < len(own):
        lines.append(
            f"  no promise on {len(own) - len(kept)} motions: full order, as well as it can"
        )
    broken = int(kept.broken.sum())
    lines.append(f"  promises broken: {broken} of {len(kept)}")
    return lines, len(kept) == len(own)


def _span(values: pd.Series) -> str:
    low, high = f"{values.min():.2g}", f"{values.max():.2g}"
    return low if low == high else f"{low} to {high}"


def _fitting(rows: pd.DataFrame, error: float | None, ms: float | None) -> tuple[list[str], bool]:
    accurate = rows[rows[ERROR] <= (np.inf if error is None else error)]
    both = accurate[accurate[MS] <= (np.inf if ms is None else ms)]
    # with a time to keep the least error is wanted, else the shortest time
    order = [ERROR, MS] if error is None else [MS, ERROR]
    if len(both):
        return [_point(row) for _, row in both.sort_values(order).head(SHOWN).iterrows()], True
    if not len(rows):
        return ["nothing was measured"], False
    if error is None:
        return [
            f"nothing measured is as fast; fastest: {_point(rows.loc[rows[MS].idxmin()])}"
        ], False
    found = ["nothing measured keeps both" if len(accurate) else "nothing measured is as accurate"]
    if len(accurate):
        found.append(f"fastest with this error: {_point(accurate.loc[accurate[MS].idxmin()])}")
    quick = rows[rows[MS] <= (np.inf if ms is None else ms)]
    if len(quick):
        found.append(f"best in this time: {_point(quick.loc[quick[ERROR].idxmin()])}")
    return found, False


def _point(row: pd.Series) -> str:
    parts = [_method(row)]
    parts += [f"{key} = {int(row[key])}" for key in ("k", "r") if not pd.isna(row[key])]
    if pd.isna(row.k) and pd.isna(row.r):
        parts.append(f"K = {int(row.iterations)}")
    return f"{', '.join(parts)}: error {row[ERROR]:.2g}, {row[MS]:.2g} ms a frame"


def _method(row: pd.Series) -> str:
    if row.position_basis != FULL:
        return f"{row.method} in a {row.position_basis} subspace"
    named = {FULL: "full order", FOM: "full order", ANDERSON: "with Anderson acceleration"}
    return named.get(row.method) or f"{row.method} of {row.group}"


def on_resolution(scaling: pd.DataFrame, iterations: int, ms: float) -> Iterator[str]:
    """Largest meshes whose frames of so many iterations take at most ``ms``, by method."""
    yield f"resolution (K = {iterations}; the errors above are those of the scene's own mesh):"
    if not len(scaling):
        yield "  not measured for this scene (key scaling.scenes of the configuration)"
        return
    single = scaling[scaling.threads == 1].sort_values("vertices")
    for method, rows in single.groupby("method", sort=False):
        times = iterations * rows.ms_per_iteration
        within = rows[times <= ms]
        name = "full order" if method == FOM else method
        if not len(within):
            yield f"  {name}: even {rows.vertices.min():,} vertices take {times.min():.2g} ms"
            continue
        more = "" if len(within) < len(rows) else ", the largest measured"
        largest = within.iloc[-1]
        took = iterations * largest.ms_per_iteration
        yield f"  {name}: {largest.vertices:,} vertices in {took:.2g} ms{more}"
