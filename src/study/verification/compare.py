"""Comparison of a table with its expected version: rows are matched, then cells are compared.

A number in a stable row has a tolerance, and a small shift of many numbers is noticed by the median
of their differences. In unstable rows, which rounding errors decide, changed runs are counted.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables import declared
from study.tables.kit.declaration import TOLERANCES, Column, Table
from study.tables.kit.results import trained

# Absolute difference of two numbers that is ignored as a rounding error of sums.
ROUNDING_ERROR = 1e-12
# Relative error above which a run counts as wrong, and the relative tolerance of such errors.
WRONG_ERROR, WRONG_TOLERANCE = 0.1, 0.3
# Relative tolerance of numbers of elements that a non-negative least-squares fit selects.
SELECTION_TOLERANCE = 0.25
# Median rule: largest median of difference / tolerance, over at least so many cells of a column, or
# of the rows of a column that share a name (of a method, a scene ...).
MEDIAN_LIMIT, MEDIAN_CELLS_OF_COLUMN, MEDIAN_CELLS_OF_NAME = 0.1, 3, 5
# Count rule: a run has changed if it ends otherwise or a number differs by more than this factor.
# This share of the unstable runs of a scene and method may change (rounded up).
CHANGED_FACTOR, CHANGED_SHARE = 5.0, 0.25
# Number of cells that may change in any text column that declares a share of changed cells.
CHANGED_TEXTS = 3
# Amplification of rounding errors by the sampling ("gain") above which reduced runs, and the gain
# and errors of approximations themselves, are unstable.
UNSTABLE_RUN_GAIN, UNSTABLE_GAIN = 1e2, 1e5
RUNS, SPECTRA, APPROXIMATIONS = "reduced_reruns", "singular_values", "reconstruction_error"
# Columns with the error of a run; the first of them that a table has decides if the run is wrong.
RUN_ERRORS = ("relative_error_within_horizon", "relative_error")
# Columns that identify a sampling of projections, and a reduced run.
SAMPLING = ["scene", "group", "method", "r"]
REDUCED_RUN = [*SAMPLING, "position_basis", "k"]
CELLS_IN_MESSAGE = 6
Difference = tuple[float, str]  # (difference over tolerance, inf if not a number; message)


def kept(table: Table) -> list[Column]:
    """Columns of ``table`` that are compared, and stored in its expected version."""
    return [column for column in table.columns if column.quantity in TOLERANCES]


def identifies(column: Column) -> bool:
    """Return whether ``column`` identifies rows, as names, parameters and sizes do."""
    return column.quantity == "exact" and not column.timed


def identities(rows: pd.DataFrame, columns: list[str]) -> list[tuple[str, ...]]:
    """Return for each row its cells in ``columns`` as texts."""
    return list(rows[columns].astype(str).itertuples(index=False, name=None))


def selected_by_fit(rows: pd.DataFrame) -> np.ndarray:
    """Boolean array: rows of ECSW, or all rows if a table without methods has its tolerance."""
    method = rows.get("method", pd.Series("ecsw" if "tau" in rows else "", rows.index))
    return method.astype(str).str.contains("ecsw").to_numpy(dtype=bool)


def matches(table: Table, expected: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """Positions ``row_x`` (expected) and ``row_y`` (found) of rows with equal identities.

    ``r`` identifies a row, too, unless a fit has selected it. Of rows with equal identities, the
    k-th expected row matches the k-th found row.
    """
    keys = []
    for frame in (expected, found):
        key = frame[[c.name for c in table.columns if identifies(c)]].map(_text).astype(str)
        if "r" in frame:
            key["r"] = frame.r.map(_text).astype(str).mask(selected_by_fit(frame), "")
        key["occurrence"] = key.groupby(list(key)).cumcount()
        keys.append(key.assign(row=range(len(key))))
    return keys[0].merge(keys[1], on=[*keys[0].columns[:-1]]).sort_values("row_x")


class Context:
    """Properties of scenes, groups and runs that show which rows are unstable.

    chaotic : scenes with frames beyond the horizon of predictability
    modes : (scene, constraint group) -> number of modes above round-off
    gains : cells in the columns `SAMPLING` -> factor by which sampling amplifies errors
    diverged : two sets of runs (cells in the columns `REDUCED_RUN`) that have no error, in the
        expected and in the found table of runs
    """

    def __init__(
        self, tables: Mapping[str, pd.DataFrame], found: pd.DataFrame | None = None
    ) -> None:
        """Read the expected ``tables``, by name, and the ``found`` table of runs, if any."""
        runs, spectra, errors = (
            tables[name] if name in tables else declared()[name].checked(pd.DataFrame())
            for name in (RUNS, SPECTRA, APPROXIMATIONS)
        )
        frames = trained(runs).groupby("scene")[["frames", "horizon_frame"]].max()
        above = spectra[spectra.above_roundoff.fillna(False)]
        amplified = errors[errors.gain.notna()]
        self.chaotic = frames.index[frames.horizon_frame < frames.frames]
        self.modes = above.groupby(["scene", "group"]).component.max().to_dict()
        self.gains: dict[tuple[str, ...], float] = dict(
            zip(identities(amplified, SAMPLING), amplified.gain, strict=True)
        )
        both = [trained(each) for each in (runs, runs[:0] if found is None else found)]
        self.diverged = [{*identities(t[t[RUN_ERRORS[0]].isna()], REDUCED_RUN)} for t in both]


class Comparison:
    """Comparison of an ``expected`` table with the ``found`` one, cell by cell.

    e, f : matching rows of the expected table (e) and of the found table (f), in equal order
    timed : for each row, the columns whose cell depends on measured times
    """

    def __init__(
        self, table: Table, expected: pd.DataFrame, found: pd.DataFrame, context: Context
    ) -> None:
        self.table, self.context, self.frames = table, context, (expected, found)
        pairs = matches(table, expected, found)
        self.positions = pairs.row_x.to_numpy(), pairs.row_y.to_numpy()
        self.e, self.f = (
            frame.iloc[rows].reset_index(drop=True)
            for frame, rows in zip(self.frames, self.positions, strict=True)
        )
        files = {n: Path(r.path) for n, r in table.reads.items() if isinstance(r, ProjectFile)}
        self.timed: Sequence[Collection[str]] = [()] * len(self.e)
        if table.timed_cells is not None:
            self.timed = table.timed_cells(self.e, **files)

    def compared(self, column: Column) -> np.ndarray:
        """Boolean array: rows in which the cell of ``column`` depends on no measured time."""
        return np.array([column.name not in names for names in self.timed], dtype=bool)

    def unstable(self, column: Column) -> np.ndarray:
        """Boolean array: rows in which rounding errors decide the cell of ``column``."""
        if identifies(column):
            return np.zeros(len(self.e), dtype=bool)
        chaotic = self.e.filter(items=["scene"]).isin([*self.context.chaotic]).any(axis=1)
        if column.quantity == "value" and column.kind == "integer" and "case" not in self.e:
            return chaotic.to_numpy(dtype=bool)
        of_sampling = column.quantity == "value" or self.table.name == APPROXIMATIONS
        gain = self._gain > (UNSTABLE_GAIN if of_sampling else UNSTABLE_RUN_GAIN)
        return chaotic.to_numpy(dtype=bool) | self._on_roundoff | gain

    @cached_property
    def _on_roundoff(self) -> np.ndarray:
        """Rows of degenerate meshes, of noise, or with all modes above round-off but one."""
        rows, modes = self.e, self.context.modes
        always = bool({"case", "noisy_axes"} & set(rows))
        if always or not {"scene", "group", "r"} <= set(rows):
            return np.full(len(rows), always)
        sizes = zip(rows.scene, rows.group, rows.r.fillna(0), strict=True)
        return np.array([r >= modes.get((s, g), np.inf) - 1 for s, g, r in sizes], dtype=bool)

    @cached_property
    def _gain(self) -> np.ndarray:
        """Largest gain in each row and of its sampling, 0 without any."""
        own = self.e.filter(regex="^gain").select_dtypes(float).max(axis=1).fillna(0.0)
        known = identities(self.e, SAMPLING) if set(SAMPLING) <= set(self.e) else [()] * len(own)
        return np.maximum(own.to_numpy(float), [self.context.gains.get(key, 0.0) for key in known])

    def tolerances(self, column: Column) -> np.ndarray:
        """Array (rows) with the tolerance of each cell of ``column``."""
        tolerance = np.full(len(self.e), column.within)
        if column.quantity == "value" and column.kind == "integer":
            tolerance[selected_by_fit(self.e)] = SELECTION_TOLERANCE
        judged = [name for name in RUN_ERRORS if name in self.e][:1]
        judged += [column.name] if "error" in column.name else []
        number = column.quantity == "error" and column.kind == "number"
        if number and judged and self.table.name != APPROXIMATIONS:
            wrong = (self.e[judged] > WRONG_ERROR).all(axis=1).to_numpy(dtype=bool)
            tolerance[wrong] = max(column.within, WRONG_TOLERANCE)
        return tolerance

    def distance(self, column: Column) -> np.ndarray:
        """Array (rows) with the difference of the expected and the found cell of ``column``.

        It is absolute for shares, and otherwise divided by the larger number. It is 0 for equal
        cells, inf for unequal texts or if one of the cells is empty.
        """
        e, f = self.e[column.name], self.f[column.name]
        if column.kind in ("text", "flag"):
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
        if column.kind in ("text", "flag") and column.tolerance is not None:
            found += _counted(comparison, column, cells)
        else:
            found += _stable(comparison, column, cells & ~unstable)
            found += _counted(comparison, column, cells & unstable)
    found.sort(key=lambda difference: -difference[0])
    text = f"{compared} cells" + (f", {counted} of them by count" if counted else "")
    return [message for _, message in found], text if compared else "it has no rows"


def _rows(comparison: Comparison) -> Iterator[Difference]:
    """Yield a difference for each row without a match, and one if the order has changed.

    A row may be missing in a table of runs with an error (`Table.only_with_error`) if its run
    diverged and thus has no error.
    """
    table, diverged, words = comparison.table, comparison.context.diverged, ("a row", "none")
    for side, frame in enumerate(comparison.frames):
        rows = frame.drop(index=frame.index[comparison.positions[side]])
        if table.only_with_error:
            newly = diverged[1 - side] - diverged[side]
            rows = rows[[run not in newly for run in identities(rows, REDUCED_RUN)]]
        for row in range(len(rows)):
            place = _place(table, rows, row)
            yield np.inf, f"{place}: expected {words[side]}, found {words[1 - side]}"
    for row in np.flatnonzero(np.diff(comparison.positions[1]) < 0)[:1]:
        yield np.inf, f"order of the rows: {_place(table, comparison.e, int(row) + 1)} has moved up"


def _stable(comparison: Comparison, column: Column, cells: np.ndarray) -> Iterator[Difference]:
    """Yield a difference for each of the ``cells`` beyond its tolerance, else for each median."""
    distance, tolerances = comparison.distance(column), comparison.tolerances(column)
    with np.errstate(all="ignore"):
        size = np.where(distance == 0.0, 0.0, distance / tolerances)
    far = np.flatnonzero(cells & (size > 1.0))
    for row in far:
        e, f = (_text(frame[column.name].iloc[row]) for frame in (comparison.e, comparison.f))
        off = f" (off by {distance[row]:.2g}, allowed {tolerances[row]:.2g})"
        place = f"{_place(comparison.table, comparison.e, int(row))}, {column.name}"
        message = f"{place}: expected {e or 'nothing'}, found {f or 'nothing'}"
        yield size[row], message + (off if np.isfinite(distance[row]) else "")
    if len(far) or column.kind in ("text", "flag"):
        return
    used = cells & comparison.e[column.name].fillna(0).ne(0).to_numpy(dtype=bool)
    names = [c.name for c in comparison.table.columns if identifies(c) and c.kind == "text"]
    groups = [("", np.arange(len(used)), MEDIAN_CELLS_OF_COLUMN)]
    for name in names if column.quantity == "error" else ():
        indices = comparison.e.groupby(name).indices.items()
        groups += [(f" of {name} {value}", rows, MEDIAN_CELLS_OF_NAME) for value, rows in indices]
    for name, rows, least in groups:
        chosen = size[rows][used[rows]]
        if len(chosen) >= least and (median := float(np.median(chosen))) > MEDIAN_LIMIT:
            words = f"expected a median difference of at most {MEDIAN_LIMIT:.0%} of the tolerance"
            yield median, f"{column.name}{name}: {words}, found {median:.0%}"


def _counted(comparison: Comparison, column: Column, cells: np.ndarray) -> Iterator[Difference]:
    """Yield a difference for each scene and method in which too many of the ``cells`` changed.

    Several changed cells of one run (of its motions, say) count once.
    """
    least_change = 1 - 1 / CHANGED_FACTOR if column.kind == "number" else 0.0
    limits = np.maximum(comparison.tolerances(column), least_change)
    changed = (comparison.distance(column) > limits)[cells]
    if not changed.any():
        return
    rows = comparison.e[cells].astype(str)
    by = [rows[name] for name in ("scene", "noisy_axes", "method") if name in rows]
    run = [*SAMPLING, *({"seed"} & set(rows))]
    share, least = CHANGED_SHARE, 1
    if column.kind in ("text", "flag") and column.tolerance is not None:
        by, run, share, least = [], ["each row"], column.tolerance, CHANGED_TEXTS
    runs = identities(rows, run) if set(run) <= set(rows) else range(len(rows))
    counted = pd.DataFrame({"run": runs, "changed": changed}, rows.index)
    for group, part in counted.groupby(by or [pd.Series("all rows", rows.index)]):
        of_runs = part.groupby("run").changed.any()
        allowed = max(least, int(np.ceil(share * len(of_runs))))
        if of_runs.sum() > allowed:
            place = f"{column.name} of {', '.join(map(str, group))}"
            words = f"at most {allowed} of {len(of_runs)} changed, found {of_runs.sum()}"
            yield np.inf, f"{place}: expected {words}"


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
