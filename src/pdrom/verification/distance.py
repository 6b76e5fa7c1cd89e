"""How far two values of a quantity are apart, in the measure in which its tolerance is given."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from pdrom.tables.quantities import Quantity

# Differences below it count for nothing: rounding errors of sums, and the tenth digit of a table.
FLOOR = 1e-10
EPSILON = float(np.finfo(float).eps)


def distance(quantity: Quantity, expected: pd.Series, found: pd.Series) -> np.ndarray:
    """Distance of each pair of cells; 0 if they are equal, inf if only one has a value."""
    same = _same(expected, found)
    if not (pd.api.types.is_numeric_dtype(expected) and pd.api.types.is_numeric_dtype(found)):
        return np.where(same, 0.0, np.inf)
    if pd.api.types.is_bool_dtype(expected) or quantity not in MEASURES:
        return np.where(same, 0.0, np.inf)
    a, b = (column.to_numpy(dtype=float, na_value=np.nan) for column in (expected, found))
    with np.errstate(all="ignore"):
        apart = MEASURES[quantity](a, b)
    return np.where(same, 0.0, np.where(np.isnan(apart), np.inf, apart))


def _same(a: pd.Series, b: pd.Series) -> np.ndarray:
    if a.dtype == b.dtype == np.dtype(float):
        x, y = a.to_numpy(), b.to_numpy()
        return (x == y) | (np.isnan(x) & np.isnan(y))
    left, right = a.astype(object), b.astype(object)
    equal = (left == right).fillna(False).to_numpy(dtype=bool)
    return equal | (a.isna().to_numpy() & b.isna().to_numpy())


def _relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    apart = np.abs(a - b)
    return np.where(apart <= FLOOR, 0.0, apart / np.maximum(np.abs(a), np.abs(b)))


def _absolute(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(a - b)


def _factor(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Larger over smaller, less one; neither below the rounding error of one."""
    low, high = (np.maximum(choose(np.abs(a), np.abs(b)), EPSILON) for choose in CHOICES)
    opposite = (np.sign(a) * np.sign(b) < 0) & (high > EPSILON)
    return np.where(opposite, np.inf, high / low - 1)


CHOICES: tuple[Callable[[np.ndarray, np.ndarray], np.ndarray], ...] = (np.minimum, np.maximum)
MEASURES: dict[Quantity, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "value": _relative,
    "error": _relative,
    "run": _relative,
    "gain": _relative,
    "drift": _relative,
    "count": _relative,
    "share": _absolute,
    "tally": _absolute,
    "magnitude": _factor,
    "ratio": _factor,
}
