"""Compare a table with its expected version: match the rows, then compare their cells.

A stable cell may differ by the tolerance of its column. Rounding errors decide the unstable cells,
a share of which may change, in each column and in each part of its rows. By the same count rule, a
share of the stable cells may shift, that is, differ by more than 10 % of their tolerance.

Git stores the expected tables in ``results/reference``, without columns that are never compared and
with numbers of `DIGITS` digits. They are CSV files, so that git shows their changes; large tables
are compressed (``.csv.xz``) to save space.
"""

import lzma
import math
from collections.abc import Iterator, Mapping
from datetime import date
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store import atomic_path, write_text
from study.artifact.paths import RESULTS
from study.artifact.reads import ProjectFile
from study.tables import declared
from study.tables.kit.declaration import TOLERANCES, WORDS, Column, Table
from study.tables.kit.results import ERROR, EXPERIMENT, trained

# Absolute difference of two numbers that is ignored as a rounding error of sums.
ROUNDING_ERROR = 1e-12
# Relative error above which a run counts as wrong, and the relative tolerance of such errors.
WRONG_ERROR, WRONG_TOLERANCE = 0.1, 0.3
# Relative tolerance of numbers of elements that a non-negative least-squares fit selects.
SELECTION_TOLERANCE = 0.25
# Relative tolerance of numbers in unstable cells: a factor of 5.
UNSTABLE_TOLERANCE = 1 - 1 / 5
# A stable cell counts as shifted if it differs by more than this part of its tolerance.
SHIFT = 0.1
# Share (rounded up) and number of cells that may change: shifted stable cells, unstable cells, and
# words. The share of changed words is the tolerance that their column declares.
SHIFTED_CELLS, UNSTABLE_CELLS, UNSTABLE_WORDS = (0.5, 2), (0.25, 1), 3
# Changed cells are counted in a whole column, and in its rows with equal values in these columns.
COUNTED_BY = ["scene", "method", "motion", "split", "noisy_axes"]
# Amplification of rounding errors above which a cell is unstable: values, results of runs.
UNSTABLE_VALUE, UNSTABLE_RUN = 1e5, 1e2
# Tables of degenerate meshes and of noise, which are unstable in all rows.
UNSTABLE_TABLES = ("hard_cases", "noise")
# Table of runs, and columns that identify a sampling of projections and a reduced run.
RUNS, SAMPLING = "reduced_reruns", ["scene", "group", "method", "r"]
REDUCED_RUN = [*SAMPLING, "position_basis", "k"]
CELLS_IN_MESSAGE = 6
Difference = tuple[float, str]  # (difference divided by tolerance, or inf if undefined; message)


def kept(table: Table) -> list[Column]:
    """Return the columns of ``table`` that are stored in its expected version and compared."""
    return [column for column in table.columns if column.quantity in TOLERANCES]


def identifies(column: Column) -> bool:
    """Return whether ``column`` identifies rows, as names, parameters and sizes do."""
    return column.quantity == "exact" and not column.timed


def identities(rows: pd.DataFrame, columns: list[str]) -> list[tuple[str, ...]]:
    """Return for each row its cells in ``columns`` as texts; ``nan`` if a column is missing."""
    cells = rows.reindex(columns=columns).itertuples(index=False, name=None)
    return [tuple("nan" if pd.isna(cell) else str(cell) for cell in row) for row in cells]


def selected_by_fit(rows: pd.DataFrame) -> np.ndarray:
    """Return a boolean array: rows of ECSW, or all rows if there is a column tau but no method."""
    method = rows.get("method", pd.Series("ecsw" if "tau" in rows else "", rows.index))
    return method.astype(str).str.contains("ecsw").to_numpy(dtype=bool)


class Context:
    """Properties of scenes and runs, from the expected ``tables`` and the ``found`` table of runs.

    chaotic : scenes with frames after the predictability horizon
    modes : cells in the columns `EXPERIMENT` -> number of modes above rounding errors
    gains : cells in the columns `SAMPLING` -> DEIM constant, by which sampling amplifies errors
    diverged : cells in the columns `REDUCED_RUN` of diverged runs: expected ones, found ones
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
        self.modes = above.groupby(EXPERIMENT).component.max().to_dict()
        self.gains = dict(zip(identities(errors, SAMPLING), errors.gain.fillna(0.0), strict=True))
        both = [trained(each) for each in (runs, runs[:0] if found is None else found)]
        self.diverged = [{*identities(each[each[ERROR].isna()], REDUCED_RUN)} for each in both]

    def amplification(self, table: Table, rows: pd.DataFrame) -> np.ndarray:
        """Return the factor by which rounding errors grow in each of the ``rows``.

        It is the largest DEIM constant in the row and of its sampling. It is infinite in unstable
        tables, chaotic scenes, and for bases of all modes above rounding errors, or all but one.
        """
        gains = rows.filter(regex="^gain").select_dtypes(float).fillna(0.0)
        gains["known"] = [self.gains.get(key, 0.0) for key in identities(rows, SAMPLING)]
        modes = [self.modes.get(key, np.inf) for key in identities(rows, EXPERIMENT)]
        unstable = rows.reindex(columns=["r"]).r.fillna(0).to_numpy(float) >= np.array(modes) - 1
        unstable |= rows.filter(items=["scene"]).isin(self.chaotic).any(axis=1).to_numpy(bool)
        unstable |= table.name in UNSTABLE_TABLES
        return np.where(unstable, np.inf, gains.max(axis=1))


class Comparison:
    """Comparison of an ``expected`` table with the ``found`` table, cell by cell.

    pairs : positions ``row_x`` (expected) and ``row_y`` (found) of rows with equal identities; if
        an identity is repeated, its k-th rows form a pair
    e, f : these rows of the expected table (e) and of the found table (f), in equal order
    parts : name of a part of these rows, see `COUNTED_BY` -> their positions
    timed : for each of these rows, the columns whose cell depends on a measured time
    """

    def __init__(
        self, table: Table, expected: pd.DataFrame, found: pd.DataFrame, context: Context
    ) -> None:
        self.table, self.context, self.frames = table, context, (expected, found)
        keys = []
        for frame in self.frames:
            key = frame[[c.name for c in table.columns if identifies(c)]].map(_text).astype(str)
            if "r" in frame:  # r also identifies a row, unless a fit has selected r elements
                key["r"] = frame.r.map(_text).astype(str).mask(selected_by_fit(frame), "")
            key["occurrence"] = key.groupby(list(key)).cumcount()
            keys.append(key.assign(row=range(len(key))))
        self.pairs = keys[0].merge(keys[1], on=[*keys[0].columns[:-1]]).sort_values("row_x")
        self.e, self.f = expected.iloc[self.pairs.row_x], found.iloc[self.pairs.row_y]
        self.amplification = context.amplification(table, self.e)
        self.parts = {"": np.arange(len(self.e))}
        if names := [name for name in COUNTED_BY if name in self.e]:
            places = [f" of {', '.join(cells)}" for cells in identities(self.e, names)]
            self.parts |= self.e.groupby(np.array(places, dtype=object)).indices
        reads = table.reads.items()
        files = {name: r.content(r.path) for name, r in reads if isinstance(r, ProjectFile)}
        self.timed = table.timed_cells(self.e, **files) if table.timed_cells else [()] * len(self.e)

    def messages(self) -> list[str]:
        """Return messages of all differences, largest first."""
        columns = chain.from_iterable(map(self.differences, kept(self.table)))
        found = sorted([*self.unmatched(), *columns], key=lambda one: -one[0])
        return [message for _, message in found]

    def unstable(self, column: Column) -> np.ndarray:
        """Return a boolean array: rows in which rounding errors decide the cell of ``column``."""
        if column.kind in WORDS and column.tolerance:
            return np.full(len(self.e), True)
        limits = {"exact": np.inf, "value": UNSTABLE_VALUE}
        return self.amplification > limits.get(column.quantity, UNSTABLE_RUN)

    def tolerances(self, column: Column) -> np.ndarray:
        """Return for each row the largest difference that is allowed in the cell of ``column``."""
        tolerance = np.full(len(self.e), 0.0 if column.kind in WORDS else column.within)
        if column.quantity == "value" and column.kind == "integer":
            tolerance[selected_by_fit(self.e)] = SELECTION_TOLERANCE
        if column.kind == "number":
            errors = [name for name in (ERROR, "relative_error") if name in self.e][:1]
            errors += [column.name] if "error" in column.name else []
            if column.quantity == "error" and errors:
                wrong = (self.e[errors] > WRONG_ERROR).all(axis=1).to_numpy(dtype=bool)
                tolerance[wrong] = max(column.within, WRONG_TOLERANCE)
            tolerance[self.unstable(column)] = UNSTABLE_TOLERANCE
        return tolerance

    def distance(self, column: Column) -> np.ndarray:
        """Return for each row the difference of the expected and the found cell of ``column``.

        The difference is absolute for shares, and otherwise divided by the larger number. It is 0
        for equal cells, inf for unequal texts or if one of the cells is empty.
        """
        name = column.name
        if column.kind in WORDS:
            e, f = (c.astype(object).where(c.notna(), "") for c in (self.e[name], self.f[name]))
            return np.where(e.to_numpy() == f.to_numpy(), 0.0, np.inf)
        a, b = (c.to_numpy(float, na_value=np.nan) for c in (self.e[name], self.f[name]))
        with np.errstate(all="ignore"):
            distance = np.abs(a - b)
            if column.quantity != "share":
                relative = distance / np.maximum(np.abs(a), np.abs(b))
                distance = np.where(distance <= ROUNDING_ERROR, 0.0, relative)
        same = (a == b) | (np.isnan(a) & np.isnan(b))
        return np.where(same, 0.0, np.nan_to_num(distance, nan=np.inf, posinf=np.inf))

    def differences(self, column: Column) -> Iterator[Difference]:
        """Yield stable cells of ``column`` beyond their tolerance, and too many changed cells."""
        distance, tolerances = self.distance(column), self.tolerances(column)
        compared = np.array([column.name not in names for names in self.timed], dtype=bool)
        unstable, far = compared & self.unstable(column), distance > tolerances
        stable = compared & ~unstable
        for row in np.flatnonzero(stable & far):
            e, f = (_text(rows[column.name].iloc[row]) or "nothing" for rows in (self.e, self.f))
            size = distance[row] / tolerances[row] if tolerances[row] else np.inf
            off = f" (off by {distance[row]:.2g}, allowed {tolerances[row]:.2g})"
            place = f"{_place(self.table, self.e, int(row))}, {column.name}"
            yield size, f"{place}: expected {e}, found {f}" + off * bool(np.isfinite(distance[row]))
        if not (stable & far).any() and column.within <= WRONG_TOLERANCE:  # not a coarse estimate
            cells = self.e[column.name]
            stable &= (cells.notna() & cells.ne(0)).to_numpy(dtype=bool)
            name = f"{column.name} differs by over 10 % of its tolerance"
            yield from self._counted(name, stable, distance > SHIFT * tolerances, *SHIFTED_CELLS)
        share = column.tolerance if column.kind in WORDS else None
        limit = (share, UNSTABLE_WORDS) if share else UNSTABLE_CELLS
        yield from self._counted(column.name, unstable, far, *limit)

    def _counted(
        self, name: str, cells: np.ndarray, changed: np.ndarray, share: float, number: int
    ) -> Iterator[Difference]:
        """Yield a difference for each part in which too many of the ``cells`` have ``changed``."""
        changed = cells & changed
        for place, part in self.parts.items() if changed.any() else ():
            total, count = int(cells[part].sum()), int(changed[part].sum())
            if count > (allowed := max(number, math.ceil(share * total))):
                text = f"at most {allowed} of {total} cells may change, {count} have changed"
                yield np.inf, f"{name}{place}: {text}"

    def unmatched(self) -> Iterator[Difference]:
        """Yield a difference for each row without a match, and one if the order has changed.

        Rows of diverged runs may be missing in a table of runs with an error.
        """
        words = ("a row", "none")
        for side, name in enumerate(("row_x", "row_y")):
            rows = self.frames[side].drop(index=self.frames[side].index[self.pairs[name]])
            diverged = self.context.diverged[1 - side] if self.table.only_with_error else set()
            for row, run in enumerate(identities(rows, REDUCED_RUN)):
                if run not in diverged:
                    text = f"expected {words[side]}, found {words[1 - side]}"
                    yield np.inf, f"{_place(self.table, rows, row)}: {text}"
        for row in np.flatnonzero(np.diff(self.pairs.row_y) < 0)[:1]:
            place = _place(self.table, self.e, int(row) + 1)
            yield np.inf, f"order of the rows: {place} has moved up"


def _text(cell: object) -> str:
    """Return the text of a cell, with fewer digits than stored; "" if the cell is empty."""
    if pd.isna(cell):
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else " ".join(str(cell).split())[:60]


def _place(table: Table, rows: pd.DataFrame, row: int) -> str:
    """Return the number of a ``row`` and its first names, parameters and values, as text."""
    names = [c.name for c in table.columns if identifies(c) or c.quantity == "value"]
    cells = [(name, _text(rows[name].iloc[row])) for name in names]
    words = [f"{name} {cell}" for name, cell in cells if cell][:CELLS_IN_MESSAGE]
    return f"row {rows.index[row] + 1} ({', '.join(words)})"


# Stored digits of numbers; the error of rounding is at most 1 % of any tolerance.
DIGITS = 9
SUFFIXES, PACKED_BYTES = (".csv", ".csv.xz"), 50_000  # larger files (in bytes) are compressed
LOG = "changes.md"
LOG_HEADER = """# Changes of the expected tables

Written by `./reproduce verify --update --reason "..."`, newest last.

"""


class Reference(NamedTuple):
    """Expected table: ``frame`` has all declared columns, the table's file has only ``columns``."""

    frame: pd.DataFrame
    columns: tuple[str, ...]


def folder_of(results: str) -> Path:
    """Return the folder of the expected tables for the results in the folder ``results``."""
    root = Path(RESULTS)
    return root / "reference" / Path(results).relative_to(root) / "tables"


def write_reference(table: Table, frame: pd.DataFrame, folder: Path) -> None:
    """Write ``frame``, the content of ``table``, as the expected table into ``folder``."""
    stored, form = frame[[c.name for c in kept(table)]], f"%.{DIGITS}g"
    content = stored.to_csv(index=False, float_format=form, lineterminator="\n").encode()
    path, other = (folder / f"{table.name}{suffix}" for suffix in SUFFIXES)
    if len(content) > PACKED_BYTES:
        path, other, content = other, path, lzma.compress(content, preset=9)
    with atomic_path(path, with_checksum=False) as temporary:
        temporary.write_bytes(content)
    other.unlink(missing_ok=True)


def read_references(folder: Path) -> dict[str, Reference]:
    """Map names to the expected tables in ``folder``; StorageError if one cannot be read."""
    found = {}
    for name, table in declared().items():
        for path in (p for suffix in SUFFIXES if (p := folder / f"{name}{suffix}").is_file()):
            try:
                frame = pd.read_csv(path)
            except (OSError, EOFError, lzma.LZMAError, ValueError) as error:
                reason = " ".join(str(error).split())
                raise StorageError(f"{path}: cannot be read ({reason})") from error
            whole = table.checked(frame.reindex(columns=list(table.column_names)))
            found[name] = Reference(whole, tuple(frame.columns))
    return found


def note(folder: Path, reason: str, day: date, code: str) -> None:
    """Add ``day``, version of the code and reason of an update to the log in ``folder``."""
    path = folder / LOG
    text = path.read_text(encoding="utf-8") if path.is_file() else LOG_HEADER
    line = f"- {day:%Y-%m-%d}, code {code}: {reason}\n"
    write_text(text + line, path, with_checksum=False)
