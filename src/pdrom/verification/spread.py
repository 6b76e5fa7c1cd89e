"""How far two sets of tables are apart: distances of all cells that are compared, by quantity."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from pdrom.tables.declaration import Table
from pdrom.tables.quantities import Quantity
from pdrom.verification.compare import Comparison
from pdrom.verification.rows import Context, chaotic_scenes, modes_above_roundoff, samples
from pdrom.verification.rows import unresolved as beyond_precision

RECONSTRUCTION = "reconstruction_error"
# Quantities with a tolerance; the others are equal, or not compared.
COMPARED: tuple[Quantity, ...] = (
    "value", "gain", "error", "run", "drift", "magnitude", "count", "tally", "share", "fragile",
    "ratio",
)  # fmt: skip
# Of these a column is judged as a whole: how many cells differ, how far the median is off.
AS_A_WHOLE: tuple[Quantity, ...] = ("fragile", "ratio")
# Fewer cells have no nine of ten.
TEN = 10


@dataclass(frozen=True)
class Spread:
    """Distances in a column, of the rows with or without the whole basis.

    rows : which of the two; rows of whole bases have tolerances of their own, and so has each
        metric of claims that compares times
    distances : one a cell; of a quantity that is judged as a whole a single one
    """

    table: str
    column: str
    quantity: Quantity
    rows: str
    distances: np.ndarray
    cells: np.ndarray

    @property
    def nine_of_ten(self) -> float:
        """Distance that nine of ten cells do not exceed; 0 of few cells."""
        if len(self.distances) < TEN:
            return 0.0
        return float(np.sort(self.distances)[int(0.9 * len(self.distances))])


OTHER, WHOLE = "other bases", "whole bases"


def spreads(comparison: Comparison) -> Iterator[Spread]:
    """Distances of a comparison, column by column."""
    for column in comparison.columns(*COMPARED):
        free = comparison.free(column)
        apart = comparison.distances[column.name]
        if column.quantity in AS_A_WHOLE:
            held = [frame[column.name].notna().to_numpy() for frame in (comparison.e, comparison.f)]
            cells = np.flatnonzero(~free & (held[0] | held[1]))
            if len(cells):
                single = np.array([_of_column(column.quantity, apart[cells])])
                worst = cells[[int(np.argmax(apart[cells]))]]
                yield Spread(
                    comparison.table.name, column.name, column.quantity, OTHER, single, worst
                )
            continue
        for rows, chosen in ((OTHER, ~comparison.whole), (WHOLE, comparison.whole)):
            cells = np.flatnonzero(~free & chosen)
            if len(cells):
                yield Spread(
                    comparison.table.name, column.name, column.quantity, rows, apart[cells], cells
                )


def _of_column(quantity: Quantity, apart: np.ndarray) -> float:
    return float(np.mean(apart > 0)) if quantity == "fragile" else float(np.median(apart))


def comparisons(
    tables: Mapping[str, Table[Any]],
    expected: Mapping[str, pd.DataFrame],
    found: Mapping[str, pd.DataFrame],
    on_times: Collection[tuple[str, str]] = (),
) -> dict[str, Comparison]:
    """Comparison of every table that both sides have, each in the context of all.

    Parameters
    ----------
    on_times : claims and parts with another verdict that says nothing
    """
    context = Context(
        chaotic_scenes(expected), modes_above_roundoff(expected), on_times=frozenset(on_times)
    )
    if RECONSTRUCTION in expected and RECONSTRUCTION in found:
        name = RECONSTRUCTION
        first = Comparison(tables[name], expected[name], found[name], context)
        unsettled = first.anew | beyond_precision(first.table, first.e)
        keys = [k for k, lost in zip(samples(first.e), unsettled, strict=True) if lost]
        context = replace(context, anew=frozenset(keys))
    return {
        name: Comparison(tables[name], expected[name], found[name], context)
        for name in tables
        if name in expected and name in found
    }
