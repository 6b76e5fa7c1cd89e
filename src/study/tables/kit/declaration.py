"""Declaration of a table: its title, columns, inputs, and the function that computes it.

The decorator `table` turns a function that returns a data frame into a `Table`, which gives the
frame the declared columns and types.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store import write_table
from study.artifact.artifact import Artifact, declare, declared_in
from study.artifact.paths import TABLE
from study.artifact.reads import Read

# Kinds of content of a column. The kind limits how far the results of two machines may differ; the
# limits are based on measurements (docs/decisions/0010-six-kinds.md).
Quantity = Literal["exact", "value", "error", "share", "timed", "skipped"]
QUANTITIES: dict[Quantity, str] = {
    "exact": "names, parameters, sizes, truth values: must be equal",
    "value": "well-conditioned numbers, and numbers of samples: relative tolerance",
    "error": "errors (relative tolerance) and outcomes (equal) of runs and approximations",
    "share": "shares, correlations and counts over many runs: absolute tolerance",
    "timed": "values that depend on timing, a compiler or a cache: not judged",
    "skipped": "rounding errors, and texts about other columns: not compared",
}
# Default tolerance of numbers between two machines: absolute for "share", relative for others.
TOLERANCES: dict[Quantity, float] = {"exact": 1e-8, "value": 1e-4, "error": 0.05, "share": 0.1}
Kind = Literal["text", "integer", "number", "flag"]
WORDS: tuple[Kind, ...] = ("text", "flag")  # kinds of columns without numbers
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]?inf", re.ASCII | re.IGNORECASE)
_DTYPES: dict[Kind, str] = {"integer": "Int64", "number": "float64", "flag": "boolean"}


@dataclass(frozen=True)
class Column:
    """Column of a table; any of its cells may be empty.

    meaning : short description of the content, which the documentation of the tables shows
    unit : empty for text, counts and dimensionless numbers
    timed : whether values depend on timing (or on memory in use), so that two runs may differ
    compared : kind of content (`Quantity`); None if it follows from the type and the name
    tolerance : allowed difference between two machines, for text and flags the fraction of rows
        that may differ; None for the default of the kind of content
    """

    kind: Kind
    name: str
    meaning: str
    unit: str = ""
    timed: bool = False
    compared: Quantity | None = None
    tolerance: float | None = None

    @property
    def quantity(self) -> Quantity:
        """Kind of values in the column; sets how far those of two machines may differ."""
        if self.compared or self.timed:
            return self.compared or "timed"
        if self.kind != "number":
            return "exact"
        return "error" if "error" in self.name or "deformation" in self.name else "value"

    @property
    def within(self) -> float:
        """Allowed difference between machines: `tolerance`, or a default (0 except for numbers)."""
        if self.kind == "integer" and self.quantity == "share":
            return 2.0  # of numbers of runs
        default = TOLERANCES.get(self.quantity, 0.0) if self.kind == "number" else 0.0
        return default if self.tolerance is None else self.tolerance

    def cast(self, values: pd.Series) -> pd.Series:
        """Convert ``values`` to the type of the column; ValueError names the first unfit cell."""
        if self.kind == "text":
            return values
        if values.dtype != _DTYPES[self.kind]:
            for row, cell in enumerate(values, start=1):
                if not self.holds(cell):
                    raise ValueError(f"row {row}: '{' '.join(str(cell).split())[:60]}'")
        if self.kind == "flag":
            # When pandas joins tables, it may turn True and False into numbers.
            flags = [None if pd.isna(value) else bool(value) for value in values]
            values = pd.Series(flags, values.index, dtype=object)
        return values.astype(_DTYPES[self.kind])

    def holds(self, cell: Any) -> bool:
        """Return whether ``cell``, maybe read as text, is empty or has the type of the column."""
        if self.kind == "flag" or pd.isna(cell):
            return pd.isna(cell) or cell in (True, False, "True", "False")
        size = float(str(cell)) if _NUMBER.fullmatch(str(cell)) else None
        whole = size is not None and size.is_integer() and abs(size) < 2.0**63
        return whole or (self.kind == "number" and size is not None)


# Functions that make a column of strings, of integers, of booleans, of floating-point numbers.
text = partial(Column, "text")
integer = partial(Column, "integer")
flag = partial(Column, "flag")
number = partial(Column, "number")
# Makes a column that counts runs or scenes; counts may differ slightly between machines.
count = partial(integer, compared="share")


def timed(column: Column) -> Column:
    """Return a copy of ``column`` that is marked as dependent on timing."""
    return replace(column, timed=True)


def interval(names: str, make: Callable[..., Column] = number, unit: str = "") -> list[Column]:
    """Return two columns with the 95 % bootstrap interval of the median in the column before."""
    low, high = names.split()
    meaning = "2.5 % bootstrap quantile of the median in the column before"
    return [make(low, meaning, unit), make(high, "97.5 % bootstrap quantile of that median", unit)]


def extremes(name: str) -> list[Column]:
    """Return columns ``name_low``, ``name_high``: least and largest ``name`` of repeated runs."""
    ends = ("low", "least"), ("high", "largest")
    return [number(f"{name}_{end}", f"{word} `{name}` of all runs") for end, word in ends]


# Makes a column of estimated errors of references; machines differed by 28 % at most.
estimate = partial(number, tolerance=0.5)
# Values of the column `reference`: full-order runs with the scene's iterations, converged runs.
ITERATIONS, CONVERGED = "iterations", "converged"
# Columns of several tables, declared once so that a name has the same meaning everywhere.
_SHARED = (
    text("scene", "name of the scene"),
    text("group", "constraint group whose projections are reduced; all: positions are reduced"),
    text("method", "method that reduces the projections; full: they are not reduced"),
    text("position_basis", "basis of the positions: pod, skinning, or full (not reduced)"),
    integer("k", "number of modes of the position basis"),
    integer(
        "r",
        "number of modes of the projections; of evaluated elements if positions are reduced",
        compared="value",
    ),
    integer("vertices", "number of vertices of the mesh"),
    integer("elements", "number of elements of the group"),
    integer("elements_sampled", "number of evaluated elements", compared="value"),
    number(
        "training_residual",
        "residual of the training equations with the sampled elements, over their right-hand "
        "sides; at most the sampling tolerance",
    ),
    integer("frames", "number of frames that the run reached", compared="error"),
    flag("finite", "no frame of the run blew up", compared="error"),
    integer("blowup_frame", "first frame that blew up", compared="error"),
    number("max_extent", "largest extent in any frame over that at the start", compared="error"),
    number("gain", "DEIM constant: norm of the inverse of the sampled modes; inf: singular"),
    number("energy_ratio", "largest energy over that of the full-order run", compared="error"),
    number("relative_error", "relative error of the positions, all frames"),
    number("relative_error_within_horizon", "relative position error before the horizon"),
    number(
        "deformation_error",
        "error of the shapes in the frames of the position error, relative to the deformation; "
        "empty if the reference moves rigidly",
    ),
    number("error_converged", "position error before the horizon, against the converged run"),
    number("deformation_converged", "deformation error against the converged run"),
    text("reference", f"full-order reference of errors: scene's {ITERATIONS} or {CONVERGED}"),
    estimate("reference_error", "estimated position error of the converged run"),
    estimate("reference_deformation_error", "estimated deformation error of that run"),
    estimate(
        "mesh_error",
        "estimated error of the scene's mesh, by Richardson's rule from three meshes, relative to "
        "the displacement; empty if the observed order is not 0.5 to 3",
    ),
    number(
        "playback_error",
        "error before the horizon if the training trajectory is replayed instead of the run",
    ),
    number(
        "error_over_extent",
        "root-mean-square distance of vertices from the reference before the horizon, over extent",
    ),
    number("shape_error", "as error_over_extent, without the best rigid motion of each frame"),
    number(
        "velocity_error",
        "error of the velocities before the horizon, over the norm of the full-order velocities",
    ),
    number(
        "energy_drift",
        "largest difference of total energy to the full-order run, over the largest full-order "
        "energy; start, every fourth frame before the horizon, without a horizon the last frame",
        compared="error",
    ),
    integer("horizon_frame", "predictability horizon of the scene: first frame that is not judged"),
    number(
        "sensitivity_floor", "largest change by perturbations before the horizon", compared="error"
    ),
    timed(number("ms_per_frame", "time of a frame", "ms")),
    timed(number("vertices_ms", "part of the frame time that computes all vertex positions", "ms")),
    timed(number("local_ms", "time of the local step in a frame", "ms")),
    timed(number("global_ms", "time of the global solve in a frame", "ms")),
    timed(number("speedup", "time of the full-order run over that of this run")),
    *map(timed, interval("speedup_low speedup_high")),
    timed(number("local_share", "share of projections and right-hand side in the frame time")),
    number("factor", "vertices along a side, over those of the scene's mesh", compared="exact"),
    number("stiffness", "factor on all weights of the scene", compared="exact"),
    integer("training_motions", "number of trajectories that train the reduced model"),
    integer("skinning", "number of skinning columns added to the modes"),
    number(
        "time_ratio",
        "frame time over that of ten plain iterations of projective dynamics, scene's mesh",
        timed=True,
    ),
    timed(number("vertices_ratio", "part of time_ratio that computes all vertex positions")),
    timed(number("offline_ratio", "training time over the time of a frame with ten iterations")),
)


def shared(names: str) -> list[Column]:
    """Columns of `_SHARED` with the space-separated ``names``; KeyError for an unknown name."""
    by_name = {column.name: column for column in _SHARED}
    return [by_name[name] for name in names.split()]


# Function of a table and of paths of project files: for each row, the columns that depend on times.
TimedCells = Callable[..., Sequence[Collection[str]]]


@dataclass(frozen=True)
class Table(Artifact):
    """Table of the study; calling it with the inputs of its function computes the data frame.

    timed_cells : function that returns for each row the columns that depend on timing; None if
        these are the same for all rows (columns marked as ``timed``)
    only_with_error : whether the table lacks runs that blew up too early to have an error
    """

    columns: tuple[Column, ...] = ()
    timed_cells: TimedCells | None = None
    only_with_error: bool = False
    rule_pattern = "{}_table"

    def __call__(self, *arguments: Any, **named: Any) -> pd.DataFrame:
        """Compute the table from its inputs and return it with the declared columns and types.

        A table has no rows if its first input is a frame without columns (no results exist).
        """
        first = named.get(next(iter(self.reads)), *arguments[:1])
        if isinstance(first, pd.DataFrame) and not len(first.columns):
            return self.checked(first)
        return self.checked(self.function(*arguments, **named))

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Compute the table in a workflow job and write it to ``outputs["table"]``."""
        write_table(self(**self.read(settings, inputs)), Path(outputs["table"]))

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns in their order."""
        return tuple(column.name for column in self.columns)

    @property
    def timing_columns(self) -> tuple[str, ...]:
        """Names of the columns that depend on timing, which differ from run to run."""
        return tuple(column.name for column in self.columns if column.timed)

    def checked(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return ``table`` with exactly the declared columns, in their order and with their types.

        Raises StorageError if a column is missing, or a value does not have the column's type.
        """
        missing = [name for name in self.column_names if name not in table.columns]
        if missing and len(table):
            raise StorageError(f"table {self.name}: lacks the column(s) {', '.join(missing)}")
        table = table.reindex(columns=list(self.column_names)).reset_index(drop=True)
        for column in self.columns:
            try:
                table[column.name] = column.cast(table[column.name])
            except (TypeError, ValueError) as error:
                place = f"table {self.name}: column '{column.name}'"
                raise StorageError(f"{place} is no {column.kind} ({error})") from error
        return table


def table(
    *, title: str, columns: Sequence[Column], reads: Mapping[str, Read], **more: Any
) -> Callable[[Callable[..., pd.DataFrame]], Table]:
    """Return a decorator for a function that computes a table, which has its name.

    ``more`` are other fields of `Table`. Raises TypeError if a column is declared twice, or the
    function's parameters do not match ``reads``.
    """

    def decorate(function: Callable[..., pd.DataFrame]) -> Table:
        name = function.__name__
        writes = {"table": TABLE.where(name=name)}
        made = Table(name, title, reads, writes, function, columns=tuple(columns), **more)
        names = made.column_names
        if twice := sorted({column for column in names if names.count(column) > 1}):
            raise TypeError(f"table {name}: column(s) declared twice: {', '.join(twice)}")
        return declare(made)

    return decorate


def declared() -> dict[str, Table]:
    """Return a mapping of names to all tables of the study."""
    return declared_in("study.tables", Table)
