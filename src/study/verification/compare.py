"""A table against the expected one: which rows belong together, how far each cell may be off.

Rounding decides about some rows, by what the expected tables say: chaotic, ill-conditioned.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables import declared
from study.tables.kit.declaration import Column, Quantity, Table
from study.tables.kit.reruns import trained

# Not compared with a reference.
NOT_COMPARED: tuple[Quantity, ...] = ("timed", "skipped")
# Differences below it count for nothing: rounding errors of sums.
FLOOR = 1e-12
# How far a number of samples from a fit, and the numbers of a wrong run, may be off, relative.
FITTED, OF_WRONG_RUNS = 0.25, 0.3
# In the names of methods whose number of elements follows from a fit with non-negative weights.
FITTING = "ecsw"
# Errors of runs on samples with a larger amplification, and errors of approximations and the
# amplification itself above the second one, have few digits or none on other kernels.
OF_RUNS, DIRECT = 1e2, 1e5
RUNS, SPECTRA, RECONSTRUCTION = "reduced_reruns", "singular_values", "reconstruction_error"
# A run with a larger error is wrong, as everywhere in the study.
WRONG = 0.1
# The error that says so, the first that a table has.
OF_RUN = ("relative_error_within_horizon", "relative_error")
# Columns that identify the samples of a reduction, and a run.
SAMPLES = ("scene", "group", "method", "r")
RUN = (*SAMPLES, "position_basis", "k")


def kept(table: Table) -> dict[str, Column]:
    """Columns of a ``table`` that are kept in its reference and compared, by name."""
    return {c.name: c for c in table.columns if c.quantity not in NOT_COMPARED}


def names_row(column: Column) -> bool:
    """Whether a column says which row it is: a name, a parameter, a size."""
    return column.quantity == "exact" and not column.timed


def names(frame: pd.DataFrame, columns: Sequence[str] = SAMPLES) -> list[tuple]:
    """Cells in ``columns`` of each row of ``frame`` that name its samples, or its run."""
    return list(frame[list(columns)].astype(str).itertuples(index=False, name=None))


def pairs(table: Table, expected: pd.DataFrame, found: pd.DataFrame) -> list[tuple[int, int]]:
    """(row of ``expected``, row of ``found``) of all rows of ``table`` that belong together.

    Rows with the same names and numbers of samples belong together; of those that are left, rows
    with the same names, in their order: a number of samples may differ where a fit leaves it.
    """
    named = [c.name for c in table.columns if names_row(c)]
    counts = [c.name for c in table.columns if c.quantity == "value" and c.kind == "integer"]
    made: list[tuple[int, int]] = []
    left = [list(range(len(expected))), list(range(len(found)))]
    for columns in ([*named, *counts], named):
        if all(left):
            here, there = _places(expected, columns, left[0]), _places(found, columns, left[1])
            made += [(row, there[key]) for key, row in here.items() if key in there]
            left = [
                [row for key, row in own.items() if key not in other]
                for own, other in ((here, there), (there, here))
            ]
    return sorted(made)


def _places(frame: pd.DataFrame, columns: Sequence[str], rows: list[int]) -> dict[tuple, int]:
    """Each of some rows by its cells and how many rows before it have the same."""
    seen, places = Counter[tuple](), {}
    cells = [[_key(cell) for cell in frame[name].iloc[rows]] for name in columns]
    for row, key in zip(rows, zip(*cells, strict=True), strict=True):
        places[*key, seen[key]] = row
        seen[key] += 1
    return places


def _key(cell: object) -> object:
    """A cell without the digits that references do not have; one word for what is missing."""
    if cell is None or cell is pd.NA or cell != cell:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else cell


@dataclass(frozen=True)
class Context:
    """Context of rows: facts from other expected tables.

    chaotic : scenes with frames beyond their horizon, where rounding errors decide
    modes : number of modes above round-off by scene and group
    gains : amplification by `SAMPLES`
    ended : `RUN` of runs without an error, of the expected and of the found runs; some tables list
        the others only
    """

    chaotic: frozenset[str] = frozenset()
    modes: Mapping[tuple[str, str], int] = field(default_factory=dict)
    gains: Mapping[tuple, float] = field(default_factory=dict)
    ended: tuple[frozenset[tuple], frozenset[tuple]] = (frozenset(), frozenset())

    @classmethod
    def of(cls, tables: Mapping[str, pd.DataFrame], found: pd.DataFrame | None = None) -> "Context":
        """Context from tables by their names, and the table of the runs that was found."""
        runs, spectra, errors = (
            tables[name] if name in tables else declared()[name].checked(pd.DataFrame())
            for name in (RUNS, SPECTRA, RECONSTRUCTION)
        )
        frames = trained(runs).groupby("scene")[["frames", "horizon_frame"]].max()
        above = spectra[spectra.above_roundoff.fillna(False)]
        amplified = errors[errors.gain.notna()]
        ended = [trained(each) for each in (runs, runs[:0] if found is None else found)]
        first, second = (frozenset(names(own[own[OF_RUN[0]].isna()], RUN)) for own in ended)
        return cls(
            chaotic=frozenset(frames.index[frames.horizon_frame < frames.frames]),
            modes=above.groupby(["scene", "group"]).component.max().astype(int).to_dict(),
            gains=dict(zip(names(amplified), amplified.gain, strict=True)),
            ended=(first, second),
        )


@dataclass
class Comparison:
    """Rows of two tables side by side.

    e, f : rows of the expected and of the found table that belong together
    """

    table: Table
    expected: pd.DataFrame
    found: pd.DataFrame
    context: Context = field(default_factory=Context)

    def __post_init__(self) -> None:
        self.pairs = pairs(self.table, self.expected, self.found)
        self.e = self.expected.iloc[[i for i, _ in self.pairs]].reset_index(drop=True)
        self.f = self.found.iloc[[j for _, j in self.pairs]].reset_index(drop=True)
        self._loose: dict[str, dict[str, np.ndarray]] = {}
        self._timed: Sequence = [()] * len(self.e)  # columns of each row, where these differ
        if self.table.timed_cells is not None:
            reads = self.table.reads.items()
            files = {name: Path(r.path) for name, r in reads if isinstance(r, ProjectFile)}
            self._timed = self.table.timed_cells(self.e, **files)

    def compared(self, column: Column) -> np.ndarray:
        """Cells of a column that are compared: those that do not depend on timing."""
        return np.array([column.name not in names for names in self._timed], dtype=bool)

    def firm(self, column: Column) -> np.ndarray:
        """Cells of a column that rounding does not decide about."""
        return ~np.any([np.zeros(len(self.e)), *self.loose(column).values()], axis=0)

    def loose(self, column: Column) -> dict[str, np.ndarray]:
        """Cells of a column that rounding decides about, by the reason."""
        if column.name not in self._loose:
            self._loose[column.name] = {} if names_row(column) else self._of_rounding(column)
        return self._loose[column.name]

    def _of_rounding(self, column: Column) -> dict[str, np.ndarray]:
        chaotic = self.e.filter(items=["scene"]).isin(list(self.context.chaotic)).any(axis=1)
        found = {"chaotic scene": chaotic.to_numpy(dtype=bool)}
        if column.quantity == "value" and column.kind == "integer" and "case" not in self.e:
            return found
        direct = column.quantity == "value" or self.table.name == RECONSTRUCTION
        return found | {
            "basis of round-off": self._of_round_off(),
            "degenerate mesh": np.full(len(self.e), "case" in self.e),
            "ill-conditioned": self._gains() > (DIRECT if direct else OF_RUNS),
        }

    def _of_round_off(self) -> np.ndarray:
        """Every mode above round-off, or all but one (without the mean), or modes below it."""
        rows, modes = self.e, self.context.modes
        if "noisy_axes" in rows or not {"scene", "group", "r"} <= set(rows.columns):
            return np.full(len(rows), "noisy_axes" in rows)
        most = [modes.get(key, np.inf) for key in zip(rows.scene, rows.group, strict=True)]
        return (rows.r >= np.array(most, dtype=float) - 1).fillna(False).to_numpy(dtype=bool)

    def _gains(self) -> np.ndarray:
        """Largest amplification of each row; 0 where none is known."""
        found = [np.zeros(len(self.e))]
        for column in self.table.columns:
            if column.name.startswith("gain") and column.quantity == "value":
                found.append(self.e[column.name].to_numpy(dtype=float))
        if set(SAMPLES) <= set(self.e.columns):
            found.append(np.array([self.context.gains.get(key, 0.0) for key in names(self.e)]))
        return np.fmax.reduce(found)

    def wrong(self, column: Column) -> np.ndarray:
        """Cells of a ``column`` of wrong runs, in which small changes may have grown.

        The run is wrong, where the table says, and so is the cell, if it is an error, by its own
        value.
        """
        judged = [name for name in OF_RUN if name in self.e][:1]
        judged += [column.name] if "error" in column.name else []
        number = column.quantity == "error" and column.kind == "number"
        if not number or not judged or self.table.name == RECONSTRUCTION:
            return np.zeros(len(self.e), dtype=bool)
        return (self.e[judged] > WRONG).all(axis=1).to_numpy(dtype=bool)

    def fitted(self) -> np.ndarray:
        """Rows of reductions whose number of samples is the outcome of a fit.

        A table that has its tolerance, ``tau``, and names no methods has no others.
        """
        if "method" not in self.e:
            return np.full(len(self.e), "tau" in self.e)
        return self.e.method.astype(str).str.contains(FITTING).to_numpy(dtype=bool)

    def limits(self, column: Column) -> np.ndarray:
        """Tolerance of each cell of a column."""
        limit = np.full(len(self.e), column.within)
        if column.quantity == "value" and column.kind == "integer":
            limit[self.fitted()] = FITTED
        limit[self.wrong(column)] = max(column.within, OF_WRONG_RUNS)
        return limit

    def beyond(self, column: Column, wider: float = 0.0) -> np.ndarray:
        """Cells that are off by more than the tolerance of their column, or than a wider one."""
        limit = np.maximum(self.limits(column), wider)
        return (self.apart(column) > limit) & self.compared(column)

    def apart(self, column: Column) -> np.ndarray:
        """Distance of each pair of cells of ``column``.

        The difference of shares, of other numbers that over the larger of the two; 0 if the cells
        are equal, inf if only one has a value.
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

    def unpaired(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Rows of the expected and of the found table without a partner.

        A table that lists only the runs that have an error (`Table.only_with_error`) lacks those
        that have none on the other side, where they have one on this side.
        """
        alone = []
        for side, frame in enumerate((self.expected, self.found)):
            rows = frame[~np.isin(np.arange(len(frame)), [pair[side] for pair in self.pairs])]
            if self.table.only_with_error:
                ended = self.context.ended[1 - side] - self.context.ended[side]
                rows = rows[[name not in ended for name in names(rows, RUN)]]
            alone.append(rows)
        return alone[0], alone[1]
