"""The bound of the machine against times by hand."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study.experiments.roofline.bound import (
    ARITHMETIC,
    DIVIDER,
    DIVISIONS,
    FLOPS,
    MEMORY,
    READ,
    ROOTS,
    bandwidth,
    bounds,
)

# a cache of 1000 bytes: 100e9 B/s inside, 20e9 outside
RATES = pd.DataFrame(
    [
        (READ, 500.0, 100.0), (READ, 1000.0, 100.0), (READ, 2000.0, 20.0), (READ, 8000.0, 20.0),
        (FLOPS, np.nan, 50.0), (DIVISIONS, np.nan, 2.0), (ROOTS, np.nan, 1.0),
    ],
    columns=["quantity", "working_set", "rate"],
)  # fmt: skip
READS = RATES[RATES.quantity == READ]


@pytest.mark.parametrize(
    ("work", "limit", "ns"),
    [
        # bytes, touches, flops, divisions, roots
        ((5000.0, 0, 100.0, 0.0, 0.0), MEMORY, 50.0),
        ((5000.0, 100, 100.0, 0.0, 0.0), MEMORY, 82.0),
        ((500.0, 0, 1000.0, 0.0, 0.0), ARITHMETIC, 20.0),
        ((500.0, 0, 100.0, 10.0, 20.0), DIVIDER, 25.0),
    ],
)
def test_the_longest_time_is_the_bound(work, limit, ns):
    columns = ["bytes", "touches", "flops", "divisions", "roots", "working_set"]
    rows = pd.DataFrame([(*work, 900.0)], columns=columns)
    (found,) = bounds(rows, RATES).itertuples()
    assert found.limit == limit
    assert found.bandwidth == pytest.approx(100.0)
    assert found.bound_us == pytest.approx(1e-3 * ns)


def test_what_fits_into_the_cache_may_stay_there():
    """A quarter of 4000 bytes stays in it: (1/4) / 100 + (3/4) / 20 of a nanosecond a byte."""
    (rate,) = bandwidth(np.array([4000.0]), READS)
    assert rate == pytest.approx(1.0 / (0.25 / 100.0 + 0.75 / 20.0))


@given(st.lists(st.floats(100.0, 1e6), min_size=1, max_size=8))
def test_larger_working_sets_are_not_read_faster(sizes):
    rates = bandwidth(np.sort(sizes), READS)
    assert (np.diff(rates) <= 1e-9).all()
    assert (rates >= 20.0 - 1e-9).all()
    assert (rates <= 100.0 + 1e-9).all()
