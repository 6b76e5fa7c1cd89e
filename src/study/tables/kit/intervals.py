"""Medians with their intervals, and whether a control confirms a time."""

from collections.abc import Sequence

import numpy as np

RESAMPLES, SEED, LEVEL = 2000, 1, 0.95
# The control compares a run with itself; where it differs by more than half, a time says nothing.
# Fixed on 2026-11-22, before any control had been measured.
CONFIRMED = 1.5


def median_interval(values: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    """Median, and the 2.5 % and 97.5 % quantiles of medians of resampled values (bootstrap).

    The quantiles of fewer than two values are the value.
    """
    # statistics take a second to load, which planning does not need
    from scipy.stats import bootstrap

    x = np.asarray(values, float)
    if len(x) < 2 or np.ptp(x) == 0.0:
        return (float(np.median(x)),) * 3
    found = bootstrap(
        (x,), np.median, n_resamples=RESAMPLES, confidence_level=LEVEL, method="percentile",
        rng=np.random.default_rng(SEED),
    ).confidence_interval  # fmt: skip
    return float(np.median(x)), float(found.low), float(found.high)


def confirmed(low: float, high: float) -> bool:
    """Whether a control confirms a ratio of times.

    Parameters
    ----------
    low, high : interval of the time of a run over that of the same run
    """
    return low >= 1.0 / CONFIRMED and high <= CONFIRMED


def in_words(median: float, low: float, high: float) -> str:
    """``median`` and interval from ``low`` to ``high`` as text."""
    return f"{_rounded(median)} ({_rounded(low)} to {_rounded(high)})"


def _rounded(value: float) -> str:
    """``value`` with two significant digits, not in powers of ten."""
    place = 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, place):.{max(0, place)}f}"
