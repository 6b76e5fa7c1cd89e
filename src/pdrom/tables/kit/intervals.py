"""Medians with their intervals, and how many digits of a time its control confirms."""

from collections.abc import Sequence

import numpy as np

RESAMPLES, SEED, LEVEL = 2000, 1, 0.95
# The control compares a run with itself. Two digits claim to be right to a twentieth, one digit to
# a half; fixed on 2026-11-22, before any control had been measured.
TWO_DIGITS, ONE_DIGIT = 1.05, 1.5


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


def confirmed_digits(low: float, high: float) -> int:
    """Digits (0, 1, 2) of a ratio of times that a control confirms.

    Parameters
    ----------
    low, high : interval of the time of a run over that of the same run
    """
    for digits, limit in ((2, TWO_DIGITS), (1, ONE_DIGIT)):
        if 1.0 / limit <= low and high <= limit:
            return digits
    return 0


def in_words(low: float, high: float, digits: int) -> str:
    """Interval ``low`` to ``high`` as text: two ``digits``, its middle with one, or nothing."""
    if digits == 0:
        return "not confirmed by its control"
    if digits == 1:
        return f"about {_rounded(np.sqrt(low * high), 1)}"
    ends = _rounded(low, 2), _rounded(high, 2)
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def _rounded(value: float, digits: int) -> str:
    """``value`` with so many significant digits, not in powers of ten."""
    place = digits - 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, place):.{max(0, place)}f}"
