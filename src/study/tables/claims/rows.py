"""Rows of tables that tests of claims compare: filtered, with their labels and a value each."""

from collections.abc import Mapping

import pandas as pd

from pdrom.core.errors import ConfigurationError

Tables = Mapping[str, pd.DataFrame]
Value = str | int | float
VALUE = "value"
LABELS = (
    "scene", "group", "method", "position_basis", "k", "r", "split", "axis", "noisy_axes", "seed",
    "component", "implementation", "factor",
)  # fmt: skip
AXES = ("x", "y", "z")


def filtered(table: pd.DataFrame, where: Mapping[str, tuple[Value, ...]]) -> pd.DataFrame:
    """Rows of ``table`` whose columns have the values that ``where`` allows.

    Raises
    ------
    ConfigurationError
        The table has no such column.
    """
    for column, allowed in where.items():
        if column not in table.columns:
            raise ConfigurationError(
                f"claims: no column '{column}' (allowed: {', '.join(table.columns)})"
            )
        table = table[table[column].isin(allowed)]
    return table


def labelled(rows: pd.DataFrame, values: pd.Series) -> pd.DataFrame:
    """Labels of ``rows``, as far as they have them, and one of ``values`` for each."""
    return rows[[label for label in LABELS if label in rows]].assign(**{VALUE: values})
