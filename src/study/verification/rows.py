"""Rows that rounding decides about, by what the expected tables say: chaotic, ill-conditioned."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from study.tables.kit.declaration import Column, Table
from study.tables.kit.reruns import trained

Pairs = list[tuple[int, int]]


def names_row(column: Column) -> bool:
    """Whether a column says which row it is: a name, a parameter, a size."""
    return column.quantity == "exact" and not column.timed


def pairs(table: Table, expected: pd.DataFrame, found: pd.DataFrame) -> Pairs:
    """(row of ``expected``, row of ``found``) of all rows of ``table`` that belong together.

    Rows with the same names and numbers of samples belong together; of those that are left, rows
    with the same names, in their order: a number of samples may differ where a fit leaves it.
    """
    made: Pairs = []
    left = [list(range(len(expected))), list(range(len(found)))]
    named = [c.name for c in table.columns if names_row(c)]
    counts = [c.name for c in table.columns if c.quantity == "value" and c.kind == "integer"]
    for columns in ([*named, *counts], named):
        if not all(left):
            break
        more = _matched(_keys(expected, columns, left[0]), _keys(found, columns, left[1]))
        made += more
        taken = [{pair[side] for pair in more} for side in (0, 1)]
        left = [[row for row in rows if row not in taken[i]] for i, rows in enumerate(left)]
    return sorted(made)


def _keys(frame: pd.DataFrame, columns: Sequence[str], rows: list[int]) -> dict[int, tuple]:
    part = frame.iloc[rows]
    cells = [[_key(cell) for cell in part[name]] for name in columns]
    return dict(zip(rows, zip(*cells, strict=True), strict=True))


def _key(cell: object) -> object:
    """A cell without the digits that references do not have; one word for what is missing."""
    if cell is None or cell is pd.NA or cell != cell:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else cell


def _matched(expected: dict[int, tuple], found: dict[int, tuple]) -> Pairs:
    waiting: dict[tuple, list[int]] = {}
    for row, key in found.items():
        waiting.setdefault(key, []).append(row)
    matched = []
    for row, key in expected.items():
        if waiting.get(key):
            matched.append((row, waiting[key].pop(0)))
    return matched


# Errors of runs on samples with a larger amplification, and errors of approximations and the
# amplification itself above the second one, have few digits or none on other kernels.
OF_RUNS, DIRECT = 1e2, 1e5
RUNS, SPECTRA, RECONSTRUCTION = "reduced_reruns", "singular_values", "reconstruction_error"
# A run with a larger error is wrong, as everywhere in the study.
WRONG = 0.1
# The error that says so, the first that a table has.
OF_RUN = ("relative_error_within_horizon", "relative_error")
# Columns that identify the samples of a reduction.
SAMPLES = ("scene", "group", "method", "r")
RUN = (*SAMPLES, "position_basis", "k")
# In the names of methods whose number of elements follows from a fit with non-negative weights.
FITTED = "ecsw"


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
        ended = _ended(tables.get(RUNS)), _ended(found)
        return cls(_chaotic(tables), _modes(tables), _gains(tables), ended)

    def loose(self, table: Table, column: Column, frame: pd.DataFrame) -> dict[str, np.ndarray]:
        """Rows of ``frame``, a ``table``, in which rounding decides about ``column``, by reason."""
        if names_row(column):
            return {}
        chaotic = {"chaotic scene": self._of_chaotic_scene(frame)}
        if column.quantity == "value" and column.kind == "integer" and "case" not in frame:
            return chaotic
        direct = column.quantity == "value" or table.name == RECONSTRUCTION
        gains = self._gains(table, frame)
        return chaotic | {
            "basis of round-off": self._of_round_off(frame),
            "degenerate mesh": np.full(len(frame), "case" in frame),
            "ill-conditioned": gains > (DIRECT if direct else OF_RUNS),
        }

    def _of_chaotic_scene(self, frame: pd.DataFrame) -> np.ndarray:
        if "scene" not in frame:
            return np.zeros(len(frame), dtype=bool)
        return frame.scene.isin(list(self.chaotic)).to_numpy(dtype=bool)

    def _of_round_off(self, frame: pd.DataFrame) -> np.ndarray:
        """Every mode above round-off, or all but one (without the mean), or modes below it."""
        if "noisy_axes" in frame:
            return np.ones(len(frame), dtype=bool)
        if not self.modes or not {"scene", "group", "r"} <= set(frame.columns):
            return np.zeros(len(frame), dtype=bool)
        keys = zip(frame.scene, frame.group, strict=True)
        most = np.array([self.modes.get(key, np.inf) for key in keys], dtype=float)
        return (frame.r >= most - 1).fillna(False).to_numpy(dtype=bool)

    def _gains(self, table: Table, frame: pd.DataFrame) -> np.ndarray:
        """Largest amplification of each row; 0 where none is known."""
        found = [np.zeros(len(frame))]
        for column in table.columns:
            if column.name.startswith("gain") and column.quantity == "value":
                found.append(frame[column.name].to_numpy(dtype=float))
        if set(SAMPLES) <= set(frame.columns):
            found.append(np.array([self.gains.get(key, 0.0) for key in names(frame)]))
        return np.fmax.reduce(found)


def of_wrong_runs(table: Table, column: Column, frame: pd.DataFrame) -> np.ndarray:
    """Cells of a ``column`` of ``frame``, a ``table``, in which small changes may have grown.

    The run is wrong, where the table says, and so is the cell, if it is an error, by its own value.
    """
    judged = [name for name in OF_RUN if name in frame][:1]
    judged += [column.name] if "error" in column.name else []
    number = column.quantity == "error" and column.kind == "number"
    if not number or not judged or table.name == RECONSTRUCTION:
        return np.zeros(len(frame), dtype=bool)
    return (frame[judged] > WRONG).all(axis=1).to_numpy(dtype=bool)


def of_fitted_samples(frame: pd.DataFrame) -> np.ndarray:
    """Rows of ``frame`` of reductions whose number of samples is the outcome of a fit.

    A table that has its tolerance, ``tau``, and names no methods has no others.
    """
    if "method" not in frame:
        return np.full(len(frame), "tau" in frame)
    return frame.method.astype(str).str.contains(FITTED).to_numpy(dtype=bool)


def names(frame: pd.DataFrame, columns: Sequence[str] = SAMPLES) -> list[tuple]:
    """Cells in ``columns`` of each row of ``frame`` that name its samples, or its run."""
    return list(frame[list(columns)].astype(str).itertuples(index=False, name=None))


def _chaotic(tables: Mapping[str, pd.DataFrame]) -> frozenset[str]:
    if RUNS not in tables:
        return frozenset()
    runs = (
        trained(tables[RUNS])
        .groupby("scene")
        .agg(end=("frames", "max"), horizon=("horizon_frame", "max"))
    )
    return frozenset(runs.index[runs.horizon < runs.end])


def _modes(tables: Mapping[str, pd.DataFrame]) -> dict[tuple[str, str], int]:
    if SPECTRA not in tables:
        return {}
    spectra = tables[SPECTRA]
    above = spectra[spectra.above_roundoff.fillna(False)]
    return above.groupby(["scene", "group"]).component.max().astype(int).to_dict()


def _gains(tables: Mapping[str, pd.DataFrame]) -> dict[tuple, float]:
    if RECONSTRUCTION not in tables:
        return {}
    rows = tables[RECONSTRUCTION]
    rows = rows[rows.gain.notna()]
    return dict(zip(names(rows), rows.gain, strict=True))


def _ended(runs: pd.DataFrame | None) -> frozenset[tuple]:
    if runs is None:
        return frozenset()
    own = trained(runs)
    return frozenset(names(own[own[OF_RUN[0]].isna()], RUN))
