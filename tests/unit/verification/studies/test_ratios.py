"""Times of one study over those of another."""

import pandas as pd
import pytest

from pdrom.tables.kit.declaration import Table, number, text, timed
from pdrom.verification.compare import Comparison
from pdrom.verification.studies.times import ratios

COLUMNS = (
    text("scene", "scene"),
    text("method", "method"),
    timed(number("ms", "time", "ms")),
    timed(number("share", "share")),
)


def comparison(a, b):
    table = Table("t", "t", {}, {}, None, False, COLUMNS)
    frames = (table.checked(pd.DataFrame(rows, columns=table.column_names)) for rows in (a, b))
    return Comparison(table, *frames)


def test_each_scene_counts_once_and_only_times_are_taken():
    a = [("x", m, 2.0, 0.5) for m in "abcde"] + [("y", "a", 4.0, 0.5), ("z", "a", 0.0, 0.5)]
    b = [("x", m, 6.0, 0.9) for m in "abcde"] + [("y", "a", 2.0, 0.5), ("z", "a", 1.0, 0.5)]
    whole, ms = ratios({"t": comparison(a, b[::-1])})
    assert (whole.table, ms.table, ms.column) == ("all tables", "t", "ms")
    assert (ms.scenes, ms.rows) == (2, 6)
    assert ms.median == pytest.approx((3 + 0.5) / 2)
    assert (ms.low, ms.high) == pytest.approx((0.5, 3))


def test_tables_without_a_common_time_have_no_ratio():
    assert ratios({"t": comparison([("x", "a", 1.0, 1.0)], [("y", "a", 1.0, 1.0)])}) == []
    assert ratios({}) == []
