"""Comparison of a table with its expected version: rows are paired, then cells are compared.

Cells that depend on rounding errors (chaotic or ill-conditioned runs) may differ in limited number.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables import declared
from study.tables.kit.declaration import TOLERANCES, Column, Table
from study.tables.kit.results import trained

# Absolute differences of two numbers up to this size are ignored as rounding errors of sums.
FLOOR = 1e-12
# Relative tolerances: for numbers of samples from a least-squares fit; for errors above `WRONG`.
FITTED, OF_WRONG_RUNS = 0.25, 0.3
# Part of the names of methods whose elements are chosen by a non-negative least-squares fit.
FITTING = "ecsw"
# Limits of the gain (error amplification by sampling). Above the first, errors of one run on two
# processors share few or no digits; above the second, so do reconstruction errors and gains.
OF_RUNS, DIRECT = 1e2, 1e5
RUNS, SPECTRA, RECONSTRUCTION = "reduced_reruns", "singular_values", "reconstruction_error"
# A run whose relative error exceeds this value counts as wrong, as in all tables of the study.
WRONG = 0.1
# Columns with a run's error; the first of them that a table has is compared with `WRONG`.
OF_RUN = ("relative_error_within_horizon", "relative_error")
# Table columns that identify samples of projections (`SAMPLES`), or a reduced run (`RUN`).
SAMPLES = ("scene", "group", "method", "r")
RUN = (*SAMPLES, "position_basis", "k")
# Largest number of cells that describe a row in a message.
NAMED = 6
# A fault may change all cells of a column, each by less than its tolerance. So the share `HALF` of
# them (`MOST` of at least `TEN` errors) must differ by at most `CLOSE`; fewer than `LEAST` cells
# must all differ by at most `LONE`. If the column declares a tolerance, the share `HALF` must
# differ by at most this tolerance / `OWN`, and fewer than `LEAST` cells are not checked. The same
# holds within each method, scene ..., where rounding errors may concentrate, with the limit `LONE`
# (`LOOSER` for columns with a tolerance, and for half of at least `TEN` wrong runs).
MOST, HALF, TEN, LEAST = 0.9, 0.5, 10, 3
CLOSE, OWN, LONE, LOOSER = 1e-5, 50, 0.01, 0.03
# Limits for cells that depend on rounding errors: (share of the runs that may differ, relative
# difference above which a run differs, columns by which the runs are grouped for counting). In each
# group, a tenth of the runs may differ by more than a factor of 10, and half by more than 2.
LOOSE = ((0.1, 1 - 1 / 10, ("scene", "noisy_axes", "method")), (0.5, 1 - 1 / 2, ("scene",)))
# If a column of texts or flags lets a share of its cells differ, at least this many may differ.
FEW = 3
Difference = tuple[float, str]  # (distance of two cells, inf if not a number; text of a message)


def kept(table: Table) -> dict[str, Column]:
    """Name -> column, for columns of ``table`` that are stored in its expected version."""
    return {c.name: c for c in table.columns if c.quantity in TOLERANCES}


def names_row(column: Column) -> bool:
    """Return whether ``column`` identifies rows, as names, parameters and sizes do."""
    return column.quantity == "exact" and not column.timed


def names(frame: pd.DataFrame, columns: Sequence[str] = SAMPLES) -> list[tuple]:
    """Return a tuple for each row of ``frame``: its cells in ``columns``, as texts."""
    return list(frame[list(columns)].astype(str).itertuples(index=False, name=None))


def pairs(table: Table, expected: pd.DataFrame, found: pd.DataFrame) -> list[tuple[int, int]]:
    """Pairs of matching rows (index in ``expected``, index in ``found``), sorted.

    Rows are first matched by identifying columns and by integer values such as numbers of samples.
    Rows left over are matched, in order, by identifying columns only: a fit that chooses samples
    may choose another number of them.
    """
    named = [c.name for c in table.columns if names_row(c)]
    counts = [c.name for c in table.columns if c.quantity == "value" and c.kind == "integer"]
    made: list[tuple[int, int]] = []
    left = [
        frame[[*named, *counts]].map(_key).assign(row=range(len(frame)))
        for frame in (expected, found)
    ]
    for columns in ([*named, *counts], named):
        # of rows with equal cells, the k-th expected one matches the k-th found one
        e, f = (rows.assign(place=rows.groupby(columns).cumcount()) for rows in left)
        both = e.merge(f, on=[*columns, "place"])
        made += zip(both.row_x, both.row_y, strict=True)
        left = [e[~e.row.isin(both.row_x)], f[~f.row.isin(both.row_y)]]
    return sorted(made)


def _key(cell: object) -> str:
    """Text of a cell by which rows are matched, with fewer digits than stored; "" if missing."""
    if cell is None or cell is pd.NA or cell != cell:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)


class Context:
    """Properties of scenes, groups and runs that show which rows depend on rounding errors.

    chaotic : scenes whose perturbed runs differ too much for a comparison in their last frames
    modes : (scene, constraint group) -> number of modes above round-off
    gains : cells in the columns `SAMPLES` -> factor by which sampling amplifies errors
    ended : two sets, from the expected and the last run's table `RUNS`: runs (cells in the columns
        `RUN`) that have no error because they ended early
    """

    def __init__(
        self, tables: Mapping[str, pd.DataFrame], found: pd.DataFrame | None = None
    ) -> None:
        """Read expected ``tables``, by name; ``found`` is table `RUNS` of the last run, if any."""
        runs, spectra, errors = (
            tables[name] if name in tables else declared()[name].checked(pd.DataFrame())
            for name in (RUNS, SPECTRA, RECONSTRUCTION)
        )
        frames = trained(runs).groupby("scene")[["frames", "horizon_frame"]].max()
        above = spectra[spectra.above_roundoff.fillna(False)]
        amplified = errors[errors.gain.notna()]
        ended = [trained(each) for each in (runs, runs[:0] if found is None else found)]
        self.chaotic = set(frames.index[frames.horizon_frame < frames.frames])
        self.modes = above.groupby(["scene", "group"]).component.max().astype(int).to_dict()
        self.gains = dict(zip(names(amplified), amplified.gain, strict=True))
        self.ended = [set(names(own[own[OF_RUN[0]].isna()], RUN)) for own in ended]


class Comparison:
    """Comparison of an expected table with the table found in the results, cell by cell.

    e, f : matching rows of the expected table (e) and of the found table (f), in equal order
    """

    def __init__(
        self, table: Table, expected: pd.DataFrame, found: pd.DataFrame, context: Context
    ) -> None:
        self.table, self.expected, self.found, self.context = table, expected, found, context
        self.pairs = pairs(table, expected, found)
        self.e = expected.iloc[[i for i, _ in self.pairs]].reset_index(drop=True)
        self.f = found.iloc[[j for _, j in self.pairs]].reset_index(drop=True)
        self.loose = cache(self._loose)  # function: `_loose` with cached return values
        self._timed: Sequence = [()] * len(self.e)  # for each row, columns that depend on timing
        if table.timed_cells is not None:
            reads = table.reads.items()
            files = {name: Path(r.path) for name, r in reads if isinstance(r, ProjectFile)}
            self._timed = table.timed_cells(self.e, **files)

    def compared(self, column: Column) -> np.ndarray:
        """Boolean array (rows): True where the cell of ``column`` depends on no measured time."""
        return np.array([column.name not in names for names in self._timed], dtype=bool)

    def firm(self, column: Column) -> np.ndarray:
        """Boolean array (rows): True where the cell of ``column`` depends on no rounding errors."""
        return ~np.any([np.zeros(len(self.e)), *self.loose(column).values()], axis=0)

    def _loose(self, column: Column) -> dict[str, np.ndarray]:
        """Reason why cells depend on rounding errors -> boolean array (rows) of such cells."""
        if names_row(column):
            return {}
        chaotic = self.e.filter(items=["scene"]).isin(list(self.context.chaotic)).any(axis=1)
        found = {"chaotic scene": chaotic.to_numpy(dtype=bool)}
        if column.quantity == "value" and column.kind == "integer" and "case" not in self.e:
            return found
        direct = column.quantity == "value" or self.table.name == RECONSTRUCTION
        return found | {
            "basis of round-off": self._of_round_off,
            "degenerate mesh": np.full(len(self.e), "case" in self.e),
            "ill-conditioned": self._gains > (DIRECT if direct else OF_RUNS),
        }

    @cached_property
    def _of_round_off(self) -> np.ndarray:
        """True if r + 1 >= number of modes above round-off; in all rows of table noise."""
        rows, modes = self.e, self.context.modes
        if "noisy_axes" in rows or not {"scene", "group", "r"} <= set(rows.columns):
            return np.full(len(rows), "noisy_axes" in rows)
        most = [modes.get(key, np.inf) for key in zip(rows.scene, rows.group, strict=True)]
        return (rows.r >= np.array(most, dtype=float) - 1).fillna(False).to_numpy(dtype=bool)

    @cached_property
    def _gains(self) -> np.ndarray:
        """Largest gain (error amplification) in each row's cells and `Context.gains`; 0 if none."""
        found = [np.zeros(len(self.e))]
        for column in self.table.columns:
            if column.name.startswith("gain") and column.quantity == "value":
                found.append(self.e[column.name].to_numpy(dtype=float))
        if set(SAMPLES) <= set(self.e.columns):
            found.append(np.array([self.context.gains.get(key, 0.0) for key in names(self.e)]))
        return np.fmax.reduce(found)

    def wrong(self, column: Column) -> np.ndarray:
        """Boolean array (rows): True where ``column`` gets the wider tolerance `OF_WRONG_RUNS`.

        There the expected table has an error of the run above `WRONG`; the cell, if an error, too.
        """
        judged = [name for name in OF_RUN if name in self.e][:1]
        judged += [column.name] if "error" in column.name else []
        number = column.quantity == "error" and column.kind == "number"
        if not number or not judged or self.table.name == RECONSTRUCTION:
            return np.zeros(len(self.e), dtype=bool)
        return (self.e[judged] > WRONG).all(axis=1).to_numpy(dtype=bool)

    def fitted(self) -> np.ndarray:
        """Boolean array: True for rows of reductions whose elements a least-squares fit selects.

        A table without a column ``method`` has only such rows if it has a column ``tau``, the
        tolerance of this fit; otherwise it has none.
        """
        if "method" not in self.e:
            return np.full(len(self.e), "tau" in self.e)
        return self.e.method.astype(str).str.contains(FITTING).to_numpy(dtype=bool)

    def limits(self, column: Column) -> np.ndarray:
        """Array (rows) with the tolerance of each cell of ``column``."""
        limit = np.full(len(self.e), column.within)
        if column.quantity == "value" and column.kind == "integer":
            limit[self.fitted()] = FITTED
        limit[self.wrong(column)] = max(column.within, OF_WRONG_RUNS)
        return limit

    def beyond(self, column: Column, wider: float = 0.0) -> np.ndarray:
        """True for compared cells for which `apart` exceeds both their tolerance and ``wider``."""
        limit = np.maximum(self.limits(column), wider)
        return (self.apart(column) > limit) & self.compared(column)

    def apart(self, column: Column) -> np.ndarray:
        """Array (rows) with the distance of the expected and the found cell of ``column``.

        It is the absolute difference for shares, and for other numbers the difference divided by
        the larger one. It is 0 for equal cells, inf for unequal texts or if one value is missing.
        """
        e, f = self.e[column.name], self.f[column.name]
        numbers = all(pd.api.types.is_numeric_dtype(cells) for cells in (e, f))
        if not numbers or pd.api.types.is_bool_dtype(e):
            equal = (e.astype(object) == f.astype(object)).fillna(False).to_numpy(dtype=bool)
            return np.where(equal | (e.isna() & f.isna()).to_numpy(dtype=bool), 0.0, np.inf)
        a, b = (cells.to_numpy(dtype=float, na_value=np.nan) for cells in (e, f))
        with np.errstate(all="ignore"):
            apart = np.abs(a - b)
            if column.quantity != "share":
                apart = np.where(apart <= FLOOR, 0.0, apart / np.maximum(np.abs(a), np.abs(b)))
        same = (a == b) | (np.isnan(a) & np.isnan(b))
        return np.where(same, 0.0, np.where(np.isnan(apart), np.inf, apart))


def judge(comparison: Comparison) -> tuple[list[str], str]:
    """Return texts of all differences, largest first, and a text on the compared cells.

    The second text has the number of compared cells and, for each cause ("chaotic scene" ...), how
    many cells depend on rounding errors; of such cells, a limited number may differ.
    """
    found = [*_rows(comparison)]
    compared, loose = 0, Counter[str]()
    for column in kept(comparison.table).values():
        found += _cells(comparison, column)
        compared += int(comparison.compared(column).sum())
        loose.update({why: int(c.sum()) for why, c in comparison.loose(column).items()})
    found.sort(key=lambda difference: -difference[0])
    reasons = ", ".join(f"{reason} {count}" for reason, count in (+loose).most_common())
    words = f"{compared} cells" + (f"; by count: {reasons}" if reasons else "")
    return [text for _, text in found], words if compared else "it has no rows"


def _difference(
    where: str, expected: str, found: str, size: float = np.inf, allowed: float = 0.0
) -> Difference:
    """Return ``size`` of a difference, and its text: place ``where``, values, limit ``allowed``."""
    off = f" (off by {size:.2g}, allowed {allowed:.2g})" if np.isfinite(size) else ""
    return size, f"{where}: expected {expected}, found {found}{off}"


def _rows(comparison: Comparison) -> Iterator[Difference]:
    """Yield a difference for each row without a matching row, and one if the order has changed.

    In a table that lists only runs with an error (`Table.only_with_error`), a row may be missing
    if its run ended early and thus has no error.
    """
    table, context, words = comparison.table, comparison.context, ("a row", "none")
    frames = comparison.expected, comparison.found
    named = [c.name for c in table.columns if names_row(c)]
    left = [
        frame.index.difference([pair[side] for pair in comparison.pairs], sort=False)
        for side, frame in enumerate(frames)
    ]
    for side, frame in enumerate(frames):
        rows = frame.loc[left[side]]
        if table.only_with_error:
            ended = context.ended[1 - side] - context.ended[side]
            rows = rows[[name not in ended for name in names(rows, RUN)]]
        for i, row in enumerate(rows.index):
            place = _row_in_words(table, rows, i)
            if row in left[0] and row in left[1]:  # name the cells that identify it otherwise
                one, other = (each.loc[row, named].map(_key) for each in frames)
                place += f" (row {row + 1}, other {', '.join(one.index[one != other])})"
            yield _difference(place, words[side], words[1 - side])
    moved = np.flatnonzero(np.diff([row for _, row in comparison.pairs]) < 0)
    if len(moved):
        place = _row_in_words(table, comparison.e, int(moved[0]) + 1)
        yield _difference(f"order of the rows, {place}", "further down", "further up")


def _cells(comparison: Comparison, column: Column) -> Iterator[Difference]:
    beyond, firm = comparison.beyond(column), comparison.firm(column)
    if column.kind in ("text", "flag") and column.tolerance:
        allowed = max(FEW, column.within * len(beyond))
        if beyond.sum() > allowed:
            place = _row_in_words(comparison.table, comparison.e, int(np.argmax(beyond)))
            words = f"at most {int(allowed)} other cells", f"{beyond.sum()}"
            yield _difference(f"{column.name}, as of {place}", *words)
        return
    apart, limits = comparison.apart(column), comparison.limits(column)
    for row in map(int, np.flatnonzero(beyond & firm)):
        place = f"{_row_in_words(comparison.table, comparison.e, row)} {column.name}".strip()
        expected, found = (
            in_words(frame[column.name].iloc[row]) for frame in (comparison.e, comparison.f)
        )
        yield _difference(place, expected, found, float(apart[row]), float(limits[row]))
    if not (beyond & firm).any() and column.kind in ("number", "integer"):
        yield from _shifted(comparison, column, firm)
    yield from _loose(comparison, column, ~firm)


def _shifted(comparison: Comparison, column: Column, firm: np.ndarray) -> Iterator[Difference]:
    """Yield a difference if most cells in ``firm`` rows are slightly off expected ones (`MOST`).

    Of errors, also one for each method, scene ... (value of a text column that identifies rows).
    """
    e, own, errors = comparison.e, column.tolerance, column.quantity == "error"
    there = (e[column.name].fillna(0) != 0).to_numpy(dtype=bool)
    cells, wrong = firm & there & comparison.compared(column), comparison.wrong(column)
    groups = [("", cells & ~wrong, CLOSE if own is None else own / OWN)]
    texts = [c.name for c in comparison.table.columns if names_row(c) and c.kind == "text"]
    for label in texts if errors and column.kind == "number" else ():
        for value, rows in e.groupby(label).indices.items():
            inside, name = cells & np.isin(np.arange(len(e)), rows), f" of {label} {value}"
            groups.append((name, inside & ~wrong, LONE if own is None else LOOSER))
            if (inside & wrong).sum() >= TEN:
                groups.append((f"{name}, wrong runs", inside & wrong, LOOSER))
    for name, chosen, close in groups:
        count = chosen.sum()
        if not count or (own is not None and count < LEAST):
            continue
        strict = errors and own is None and count >= TEN and not (chosen & wrong).any()
        share, limit = (MOST if strict else HALF, close) if count >= LEAST else (1.0, LONE)
        size = float(np.quantile(comparison.apart(column)[chosen], share))
        if size > limit:
            words = f"a share of {share:g} of the cells within {limit:g}", f"within {size:.2g}"
            yield _difference(f"{column.name}{name}", *words, size, limit)


def _loose(comparison: Comparison, column: Column, cells: np.ndarray) -> Iterator[Difference]:
    """Yield a difference for each group in which more runs differ than `LOOSE` allows.

    Only the given ``cells``, which depend on rounding errors, are counted. A value that is missing
    in one of the two tables counts as a difference. Several cells of one run count once.
    """
    rows = comparison.e[cells]
    run = [*SAMPLES, *({"seed"} & set(rows.columns))]
    for share, wider, by in LOOSE:
        other = comparison.beyond(column, wider if column.kind == "number" else 0.0)[cells]
        if not other.any():
            continue
        runs = names(rows, run) if set(run) <= set(rows.columns) else range(len(rows))
        counted = pd.DataFrame({"run": runs, "other": other}, rows.index)
        named = [rows[name] for name in by if name in rows and "scene" in rows]
        all_rows = [pd.Series("all rows", rows.index)]
        for group, part in counted.groupby(named or all_rows, dropna=False):
            of_runs = part.groupby("run").other.any()
            allowed = max(1.0, share * len(of_runs))
            if of_runs.sum() > allowed:
                place = f"{column.name} of {', '.join(map(str, group))}"
                words = f"at most {int(allowed)} of {len(of_runs)} other", f"{of_runs.sum()}"
                yield _difference(place, *words)


def in_words(value: object) -> str:
    """Cell ``value`` as text for a message."""
    if pd.isna(value):
        return "nothing"
    return f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).split())[:60]


def _row_in_words(table: Table, frame: pd.DataFrame, row: int) -> str:
    """Text that identifies a ``row``: up to `NAMED` of its names, sizes and values."""
    columns = [c.name for c in table.columns if names_row(c) or c.quantity == "value"]
    cells = [(name, frame[name].iloc[row]) for name in columns]
    named = [f"{name} {in_words(value)}" for name, value in cells if not pd.isna(value)]
    return ", ".join(named[:NAMED])
