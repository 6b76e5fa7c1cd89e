"""Distance of two values of a quantity, in the measure in which its tolerance is given."""

import numpy as np
import pandas as pd

from study.tables.kit.declaration import Quantity

# Differences below it count for nothing: rounding errors of sums.
FLOOR = 1e-12


def distance(quantity: Quantity, expected: pd.Series, found: pd.Series) -> np.ndarray:
    """Distance of each pair of cells of ``expected`` and ``found``.

    The difference where ``quantity`` is a share, of other numbers that over the larger of the two;
    0 if the cells are equal, inf if only one has a value.
    """
    same = _same(expected, found)
    numbers = pd.api.types.is_numeric_dtype(expected) and pd.api.types.is_numeric_dtype(found)
    if not numbers or pd.api.types.is_bool_dtype(expected):
        return np.where(same, 0.0, np.inf)
    a, b = (column.to_numpy(dtype=float, na_value=np.nan) for column in (expected, found))
    with np.errstate(all="ignore"):
        apart = np.abs(a - b)
        if quantity != "share":
            apart = np.where(apart <= FLOOR, 0.0, apart / np.maximum(np.abs(a), np.abs(b)))
    return np.where(same, 0.0, np.where(np.isnan(apart), np.inf, apart))


def _same(a: pd.Series, b: pd.Series) -> np.ndarray:
    if a.dtype == b.dtype == np.dtype(float):
        x, y = a.to_numpy(), b.to_numpy()
        return (x == y) | (np.isnan(x) & np.isnan(y))
    left, right = a.astype(object), b.astype(object)
    equal = (left == right).fillna(False).to_numpy(dtype=bool)
    return equal | (a.isna().to_numpy() & b.isna().to_numpy())
