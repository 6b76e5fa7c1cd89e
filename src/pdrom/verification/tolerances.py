"""The table of tolerances: derived from variants of a run, kept with the expected tables."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.errors import StorageError
from pdrom.core.store import read_table
from pdrom.tables.declaration import Table
from pdrom.tables.quantities import Quantity
from pdrom.verification.settings import Settings
from pdrom.verification.spread import COMPARED, OTHER, WHOLE, Spread

COLUMNS = (
    "quantity", "rows", "variants", "cells", "median", "nine_of_ten", "largest", "where", "variant",
    "margin", "least", "tolerance", "tolerance_of_nine",
)  # fmt: skip


@dataclass(frozen=True)
class Tolerance:
    """How far cells may be apart.

    every : any cell
    nine : nine of ten cells of a column
    """

    every: float
    nine: float


Tolerances = Mapping[tuple[Quantity, str], Tolerance]


def derived(found: Mapping[str, Iterable[Spread]], settings: Settings) -> pd.DataFrame:
    """Table of tolerances from the spreads of every variant, by its name.

    Raises
    ------
    StorageError
        If a variant has no number where the plain run has one, in a row that is compared.
    """
    by_kind: dict[tuple[Quantity, str], list[tuple[str, Spread]]] = {}
    for variant, spreads in found.items():
        for spread in spreads:
            _require_finite(variant, spread)
            by_kind.setdefault((spread.quantity, spread.rows), []).append((variant, spread))
    kinds = sorted(by_kind, key=lambda kind: (COMPARED.index(kind[0]), kind[1]))
    rows = [_row(quantity, rows, by_kind[quantity, rows], settings) for quantity, rows in kinds]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _require_finite(variant: str, spread: Spread) -> None:
    if not np.isfinite(spread.distances).all():
        raise StorageError(
            f"variant '{variant}': {spread.table}.{spread.column} has another number of values "
            f"than the plain run; quantity '{spread.quantity}' is not the right one for it"
        )


def _row(
    quantity: Quantity, rows: str, found: list[tuple[str, Spread]], settings: Settings
) -> dict[str, object]:
    apart = np.concatenate([spread.distances for _, spread in found])
    variant, widest = max(found, key=lambda pair: pair[1].distances.max())
    nine = max(spread.nine_of_ten for _, spread in found)
    margin, least = settings.margins[quantity], settings.least[quantity]
    return {
        "quantity": quantity,
        "rows": rows,
        "variants": len({name for name, _ in found}),
        "cells": len(apart),
        "median": np.median(apart),
        "nine_of_ten": nine,
        "largest": apart.max(),
        "where": f"{widest.table}.{widest.column}" if apart.max() > 0 else "",
        "variant": variant if apart.max() > 0 else "",
        "margin": margin,
        "least": least,
        "tolerance": max(margin * apart.max(), least),
        "tolerance_of_nine": max(margin * nine, least),
    }


def load_tolerances(paths: Sequence[Path]) -> Tolerances:
    """Tolerances by quantity and rows, the widest of some tables.

    Raises
    ------
    StorageError
        A table is missing or damaged, or all of them lack a quantity.
    """
    found: dict[tuple[Quantity, str], Tolerance] = {}
    for path in paths:
        for row in read_table(path, COLUMNS, result=False).itertuples():
            before = found.get((row.quantity, row.rows), Tolerance(0.0, 0.0))
            found[row.quantity, row.rows] = Tolerance(
                max(before.every, row.tolerance), max(before.nine, row.tolerance_of_nine)
            )
    for quantity in COMPARED:
        if (quantity, OTHER) not in found:
            raise StorageError(f"{paths[0]}: no tolerance of the quantity '{quantity}'")
        found.setdefault((quantity, WHOLE), found[quantity, OTHER])
    return found


def tolerance_text(table: Table, tolerances: Tolerances) -> str:
    """How exactly a table is expected to be reproduced, in a few words for a reader."""
    held = {column.quantity for column in table.columns}
    parts = [_words(quantity, tolerances) for quantity in COMPARED if quantity in held]
    if held & {"exact", "verdict"}:
        parts.insert(0, "names, sizes and verdicts equal" if "verdict" in held else "names equal")
    if "time" in held or "clocked" in held:
        parts.append("times not compared")
    return "; ".join(parts)


def _words(quantity: Quantity, tolerances: Tolerances) -> str:
    limit = tolerances[quantity, OTHER]
    match quantity:
        case "magnitude":
            return f"magnitudes within a factor of {limit.every + 1:.2g}"
        case "ratio":
            return f"median ratio of times within a factor of {limit.every + 1:.2g}"
        case "tally":
            return f"tallies within {limit.every:.2g}"
        case "share":
            return f"shares within {limit.every:.2g}"
        case "fragile":
            return f"at most {limit.every:.1%} of the fragile verdicts and outcomes"
        case "count":
            return f"counts within {limit.every:.0%} where samples are chosen anew"
    names = {"value": "values", "gain": "gains", "error": "errors", "run": "runs"}
    name = names.get(quantity, "sensitivities")
    return f"{name} within {limit.every:.0e} (nine of ten within {limit.nine:.0e})"
