"""Comparison of a table with its expected version: rows are matched, then cells are compared.

A cell in a stable row has the tolerance of its column, and most cells differ by much less. In
unstable rows, which rounding errors decide, changed cells are counted.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables import declared
from study.tables.kit.declaration import TOLERANCES, WORDS, Column, Table
from study.tables.kit.results import ERROR, trained

# Absolute difference of two numbers that is ignored as a rounding error of sums.
ROUNDING_ERROR = 1e-12
# Relative error above which a run counts as wrong, and the relative tolerance of such errors.
WRONG_ERROR, WRONG_TOLERANCE = 0.1, 0.3
# Relative tolerance of numbers of elements that a non-negative least-squares fit selects.
SELECTION_TOLERANCE = 0.25
# Cells are counted in a whole column, and in rows that are equal in these columns.
COUNTED_BY = ["scene", "method", "motion", "split", "noisy_axes"]
# Share (rounded up) and number of stable cells that may differ by a fraction of their tolerance.
SHIFTED_FRACTION, SHIFTED_SHARE, SHIFTED_CELLS = 0.1, 0.5, 2
# Share (rounded up) and number of unstable cells that may end otherwise or, of numbers, differ by
# more than a factor of 5; number of words that may change in a column that declares a share.
CHANGED_DIFFERENCE, CHANGED_SHARE, CHANGED_CELLS, CHANGED_WORDS = 1 - 1 / 5, 0.25, 1, 3
# Amplification of rounding errors by the sampling ("gain") above which values, and the results of
# reduced runs, are unstable; tables of degenerate meshes and of noise, which always are.
UNSTABLE_GAIN, UNSTABLE_RUN_GAIN, UNSTABLE_TABLES = 1e5, 1e2, ("hard_cases", "noise")
# Table of runs, and columns that identify a sampling of projections and a reduced run.
RUNS, SAMPLING = "reduced_reruns", ["scene", "group", "method", "r"]
REDUCED_RUN = [*SAMPLING, "position_basis", "k"]
CELLS_IN_MESSAGE = 6
Difference = tuple[float, str]  # (difference over tolerance, inf if not a number; message)


def kept(table: Table) -> list[Column]:
    """Columns of ``table`` that are compared, and stored in its expected version."""
    return [column for column in table.columns if column.quantity in TOLERANCES]


def identifies(column: Column) -> bool:
    """Return whether ``column`` identifies rows, as names, parameters and sizes do."""
    return column.quantity == "exact" and not column.timed


def fragile(column: Column) -> bool:
    """Return whether ``column`` has words or flags of which it declares a share that may change."""
    return column.kind in WORDS and column.tolerance is not None


def identities(rows: pd.DataFrame, columns: list[str]) -> list[tuple[str, ...]]:
    """Return for each row its cells in ``columns`` as texts."""
    return list(rows[columns].astype(str).itertuples(index=False, name=None))


def selected_by_fit(rows: pd.DataFrame) -> np.ndarray:
    """Boolean array: rows of ECSW, or all rows if a table without methods has its tolerance."""
    method = rows.get("method", pd.Series("ecsw" if "tau" in rows else "", rows.index))
    return method.astype(str).str.contains("ecsw").to_numpy(dtype=bool)


class Context:
    """Facts on all tables that the expected ``tables`` and the ``found`` table of runs show.

    chaotic : scenes with frames beyond the horizon of predictability
    modes : (scene, constraint group) -> number of modes above round-off
    gains : cells in the columns `SAMPLING` -> factor by which sampling amplifies errors
    diverged : cells in the columns `REDUCED_RUN` of runs without an error: expected ones, found
    """

    def __init__(
        self, tables: Mapping[str, pd.DataFrame], found: pd.DataFrame | None = None
    ) -> None:
        runs, spectra, errors = (
            tables[name] if name in tables else declared()[name].checked(pd.DataFrame())
            for name in (RUNS, "singular_values", "reconstruction_error")
        )
        frames = trained(runs).groupby("scene")[["frames", "horizon_frame"]].max()
        above = spectra[spectra.above_roundoff.fillna(False)]
        self.chaotic = list(frames.index[frames.horizon_frame < frames.frames])
        self.modes = above.groupby(["scene", "group"]).component.max().to_dict()
        self.gains = dict(zip(identities(errors, SAMPLING), errors.gain.fillna(0.0), strict=True))
        both = [trained(each) for each in (runs, runs[:0] if found is None else found)]
        self.diverged = [{*identities(each[each[ERROR].isna()], REDUCED_RUN)} for each in both]


class Comparison:
    """Comparison of an ``expected`` table with the ``found`` one, cell by cell.

    pairs : positions ``row_x`` (expected) and ``row_y`` (found) of rows with equal identities; of
        several, the k-th expected row has the k-th found one
    e, f : these rows of the expected table (e) and of the found table (f), in equal order
    """

    def __init__(
        self, table: Table, expected: pd.DataFrame, found: pd.DataFrame, context: Context
    ) -> None:
        self.table, self.context, self.frames = table, context, (expected, found)
        keys = []
        for frame in self.frames:
            key = frame[[c.name for c in table.columns if identifies(c)]].map(_text).astype(str)
            if "r" in frame:  # it identifies a row, too, unless a fit has selected it
                key["r"] = frame.r.map(_text).astype(str).mask(selected_by_fit(frame), "")
            key["occurrence"] = key.groupby(list(key)).cumcount()
            keys.append(key.assign(row=range(len(key))))
        self.pairs = keys[0].merge(keys[1], on=[*keys[0].columns[:-1]]).sort_values("row_x")
        self.e = expected.iloc[self.pairs.row_x].reset_index(drop=True)
        self.f = found.iloc[self.pairs.row_y].reset_index(drop=True)

    def compared(self, column: Column) -> np.ndarray:
        """Boolean array: rows in which the cell of ``column`` depends on no measured time."""
        return np.array([column.name not in names for names in self._timed], dtype=bool)

    @cached_property
    def _timed(self) -> Sequence[Collection[str]]:
        if self.table.timed_cells is None:
            return [()] * len(self.e)
        reads = self.table.reads.items()
        files = {name: r.content(r.path) for name, r in reads if isinstance(r, ProjectFile)}
        return self.table.timed_cells(self.e, **files)

    def unstable(self, column: Column) -> np.ndarray:
        """Boolean array: rows in which rounding errors decide the cell of ``column``."""
        if column.quantity == "exact" or fragile(column):
            return np.full(len(self.e), fragile(column))
        limit = UNSTABLE_GAIN if column.quantity == "value" else UNSTABLE_RUN_GAIN
        return self._unstable_rows | (self._gain > limit)

    @cached_property
    def _unstable_rows(self) -> np.ndarray:
        """Rows of unstable tables, of chaotic scenes, and of all modes above round-off but one."""
        if self.table.name in UNSTABLE_TABLES:
            return np.full(len(self.e), True)
        chaotic = self.e.filter(items=["scene"]).isin(self.context.chaotic).any(axis=1)
        rows = self.e.reindex(columns=["scene", "group", "r"]).fillna({"r": 0})
        modes = [
            self.context.modes.get((row.scene, row.group), np.inf) for row in rows.itertuples()
        ]
        return np.asarray(chaotic | (rows.r.to_numpy(float) >= np.array(modes) - 1), dtype=bool)

    @cached_property
    def _gain(self) -> np.ndarray:
        """Largest gain in each row and of its sampling, 0 without any."""
        own = self.e.filter(regex="^gain").select_dtypes(float).max(axis=1).fillna(0.0)
        known = identities(self.e, SAMPLING) if set(SAMPLING) <= set(self.e) else [()] * len(own)
        return np.maximum(own.to_numpy(float), [self.context.gains.get(key, 0.0) for key in known])

    def tolerances(self, column: Column) -> np.ndarray:
        """Array (rows) with the largest difference of each cell of ``column`` that is no change."""
        tolerance = np.full(len(self.e), 0.0 if column.kind in WORDS else column.within)
        if column.quantity == "value" and column.kind == "integer":
            tolerance[selected_by_fit(self.e)] = SELECTION_TOLERANCE
        if column.kind == "number":
            errors = [name for name in (ERROR, "relative_error") if name in self.e][:1]
            errors += [column.name] if "error" in column.name else []
            if column.quantity == "error" and errors:
                wrong = (self.e[errors] > WRONG_ERROR).all(axis=1).to_numpy(dtype=bool)
                tolerance[wrong] = max(column.within, WRONG_TOLERANCE)
            tolerance[self.unstable(column)] = CHANGED_DIFFERENCE
        return tolerance

    def distance(self, column: Column) -> np.ndarray:
        """Array (rows) with the difference of the expected and the found cell of ``column``.

        It is absolute for shares, and otherwise divided by the larger number. It is 0 for equal
        cells, inf for unequal texts or if one of the cells is empty.
        """
        e, f = self.e[column.name], self.f[column.name]
        if column.kind in WORDS:
            equal = (e.astype(object) == f.astype(object)).fillna(False) | (e.isna() & f.isna())
            return np.where(equal.to_numpy(dtype=bool), 0.0, np.inf)
        a, b = (cells.to_numpy(dtype=float, na_value=np.nan) for cells in (e, f))
        with np.errstate(all="ignore"):
            distance = np.abs(a - b)
            if column.quantity != "share":
                relative = distance / np.maximum(np.abs(a), np.abs(b))
                distance = np.where(distance <= ROUNDING_ERROR, 0.0, relative)
        same = (a == b) | (np.isnan(a) & np.isnan(b))
        return np.where(same, 0.0, np.nan_to_num(distance, nan=np.inf, posinf=np.inf))


def judge(comparison: Comparison) -> tuple[list[str], str]:
    """Return messages of all differences, largest first, and a text with the compared cells."""
    found, compared, counted = [*_rows(comparison)], 0, 0
    for column in kept(comparison.table):
        cells, unstable = comparison.compared(column), comparison.unstable(column)
        compared, counted = compared + int(cells.sum()), counted + int((cells & unstable).sum())
        found += _cells(comparison, column, cells & ~unstable, cells & unstable)
    found.sort(key=lambda difference: -difference[0])
    text = f"{compared} cells" + (f", {counted} of them by count" if counted else "")
    return [message for _, message in found], text if compared else "it has no rows"


def _rows(comparison: Comparison) -> Iterator[Difference]:
    """Yield a difference for each row without a match, and one if the order has changed.

    Rows of diverged runs may be missing in a table of runs with an error.
    """
    table, pairs, words = comparison.table, comparison.pairs, ("a row", "none")
    for side, name in enumerate(("row_x", "row_y")):
        frame = comparison.frames[side]
        rows = frame.drop(index=frame.index[pairs[name]])
        diverged = comparison.context.diverged[1 - side] if table.only_with_error else ()
        if diverged:
            rows = rows[[run not in diverged for run in identities(rows, REDUCED_RUN)]]
        for row in range(len(rows)):
            place = _place(table, rows, row)
            yield np.inf, f"{place}: expected {words[side]}, found {words[1 - side]}"
    for row in np.flatnonzero(np.diff(pairs.row_y) < 0)[:1]:
        yield np.inf, f"order of the rows: {_place(table, comparison.e, int(row) + 1)} has moved up"


def _cells(
    comparison: Comparison, column: Column, stable: np.ndarray, unstable: np.ndarray
) -> Iterator[Difference]:
    """Yield each ``stable`` cell beyond its tolerance, and too many shifted or changed cells."""
    distance, tolerances = comparison.distance(column), comparison.tolerances(column)
    cells, shifted = comparison.e[column.name], distance > SHIFTED_FRACTION * tolerances
    far = np.flatnonzero(stable & (distance > tolerances))
    for row in far:
        e, f = (_text(frame[column.name].iloc[row]) for frame in (comparison.e, comparison.f))
        off = f" (off by {distance[row]:.2g}, allowed {tolerances[row]:.2g})"
        place = f"{_place(comparison.table, comparison.e, int(row))}, {column.name}"
        message = f"{place}: expected {e or 'nothing'}, found {f or 'nothing'}"
        size = distance[row] / tolerances[row] if tolerances[row] else np.inf
        yield size, message + off * bool(np.isfinite(distance[row]))
    coarse = column.within > WRONG_TOLERANCE  # an estimate, of which no shift says anything
    if not (len(far) or coarse or column.kind in WORDS):
        nonzero = stable & cells.fillna(0).ne(0).to_numpy(dtype=bool)
        rows, name = comparison.e[nonzero], f"{column.name} differs by a tenth of its tolerance"
        yield from _counted(rows, shifted[nonzero], name, SHIFTED_SHARE, SHIFTED_CELLS)
    rows, changed = comparison.e[unstable], (distance > tolerances)[unstable]
    limits = (column.within, CHANGED_WORDS) if fragile(column) else (CHANGED_SHARE, CHANGED_CELLS)
    yield from _counted(rows, changed, column.name, *limits)


def _counted(
    rows: pd.DataFrame, changed: np.ndarray, name: str, share: float, least: int
) -> Iterator[Difference]:
    """Yield a difference for each part of ``rows`` with too many ``changed`` cells."""
    if not changed.any():
        return
    parts = {"": np.arange(len(rows))}
    if names := [column for column in COUNTED_BY if column in rows]:
        places = rows[names].astype(str).agg(", ".join, axis=1)
        parts |= {f" of {place}": part for place, part in rows.groupby(places).indices.items()}
    for place, part in parts.items():
        allowed, count = max(least, int(np.ceil(share * len(part)))), int(changed[part].sum())
        if count > allowed:
            expected = f"expected at most {allowed} of {len(part)} changed, found {count}"
            yield np.inf, f"{name}{place}: {expected}"


def _text(cell: object) -> str:
    """Text of a cell, with fewer digits than stored; empty if the cell is missing."""
    if pd.isna(cell):
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else " ".join(str(cell).split())[:60]


def _place(table: Table, rows: pd.DataFrame, row: int) -> str:
    """Number of a ``row``, and the first names, parameters and values in it, for a message."""
    names = [c.name for c in table.columns if identifies(c) or c.quantity == "value"]
    cells = [(name, _text(rows[name].iloc[row])) for name in names]
    words = [f"{name} {cell}" for name, cell in cells if cell][:CELLS_IN_MESSAGE]
    return f"row {rows.index[row] + 1} ({', '.join(words)})"
