"""A table against the expected one, cell by cell.

What is compared depends on the quantity of the column (`pdrom.tables.quantities`) and on the row
(`pdrom.verification.rows`). Some cells are not compared, each for a reason that is counted.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd

from pdrom.tables.declaration import Column, Table
from pdrom.tables.quantities import Quantity
from pdrom.verification.distance import distance
from pdrom.verification.pairing import pairs
from pdrom.verification.rows import FAILED, PARTS, Context, failed, said_to_fail, unresolved

CLOCK = ("time", "clocked")
# Amplifications and counts that differ by less belong to the same samples.
SAME = 1e-6


@dataclass
class Comparison:
    """Rows of two tables side by side, and what may differ in them.

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
        self.failed = failed(self.table, self.e), failed(self.table, self.f)
        self.ill = unresolved(self.table, self.e) & unresolved(self.table, self.f)
        self.chaotic = self.context.of_chaotic_scene(self.e)
        self.whole = self.context.of_whole_basis(self.e)

    def columns(self, *quantities: Quantity) -> Iterator[Column]:
        """Columns of some quantities."""
        return (c for c in self.table.columns if c.quantity in quantities)

    @cached_property
    def distances(self) -> dict[str, np.ndarray]:
        """Distance of each pair of cells, by column."""
        return {
            c.name: distance(c.quantity, self.e[c.name], self.f[c.name]) for c in self.table.columns
        }

    @cached_property
    def anew(self) -> np.ndarray:
        """Rows whose samples rounding has chosen anew.

        Their amplification or their number has changed, and the run with it: either alone would be
        an error, not another choice.
        """
        chosen = self._any(SAME, "gain", "count")
        moved = self._any(SAME, "error", "run", "magnitude")
        return (chosen & moved & ~self.ill) | self.context.of_other_samples(self.e)

    def _any(self, beyond: float, *quantities: Quantity) -> np.ndarray:
        found = np.zeros(len(self.e), dtype=bool)
        for column in self.columns(*quantities):
            found |= self.distances[column.name] > beyond
        return found

    def reasons(self, column: Column) -> dict[str, np.ndarray]:
        """Cells of a column that are not compared, by the reason; the first one counts."""
        whole = np.ones(len(self.e), dtype=bool)
        match column.quantity:
            case "time" | "clocked":
                return {"a clock has a say": whole}
            case "told":
                return {"words about other columns": whole}
            case "rounding":
                return {"made of rounding errors": whole}
            case "verdict" | "fragile":
                part = PARTS.get(column.name, "")
                return {"rests on times": self.context.of_verdict_on_times(self.e, part)}
            case "exact" | "tally" | "share":
                return {}
        reasons = {"chaotic beyond the horizon": self.chaotic}
        match column.quantity:
            case "run" | "magnitude":
                reasons["failed run"] = self.failed[0] | self.failed[1]
            case "error":
                reasons["failed run"] = self._failed_cells(column)
        if column.quantity in ("run", "error", "gain", "drift"):
            reasons["amplification beyond double precision"] = self.ill
            reasons["samples chosen anew"] = self.anew
        return reasons

    def _failed_cells(self, column: Column) -> np.ndarray:
        """Cells that say on both sides that the run failed."""
        found = []
        for frame, failing in ((self.e, self.failed[0]), (self.f, self.failed[1])):
            values = frame[column.name]
            found.append((values > FAILED).to_numpy(dtype=bool) | (values.isna() & failing))
        return np.asarray(found[0] & found[1], dtype=bool)

    def free(self, column: Column) -> np.ndarray:
        """Cells of a column that are not compared."""
        made = np.zeros(len(self.e), dtype=bool)
        for cells in self.reasons(column).values():
            made |= cells
        return made

    @property
    def class_changed(self) -> np.ndarray:
        """Rows that say in words that the run failed, or did not, unlike the expected ones.

        Where an error says it, the error is compared. Fragile outcomes are counted.
        """
        words = [said_to_fail(self.table, frame) for frame in (self.e, self.f)]
        changed = (words[0] != words[1]) & (self.failed[0] != self.failed[1])
        return changed & ~self.chaotic & (not any(self.columns("fragile")))

    def unpaired(self) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Rows of the expected and of the found table without a partner.

        Where only one side has such rows, those of failed runs and of chaotic scenes are left out:
        some tables list no failed runs.
        """
        alone = [
            frame[~np.isin(np.arange(len(frame)), [pair[side] for pair in self.pairs])]
            for side, frame in enumerate((self.expected, self.found))
        ]
        if all(len(frame) for frame in alone):
            return alone[0], alone[1]
        return self._unexcused(alone[0]), self._unexcused(alone[1])

    def _unexcused(self, rows: pd.DataFrame) -> pd.DataFrame:
        return rows[~(failed(self.table, rows) | self.context.of_chaotic_scene(rows))]
