"""The published code's choices beside its output, from small files, against sums by hand."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import write_table
from study.artifact.paths import File
from study.tables.published_choices import published_choices
from study.tables.published_distance import published_distance

KEYS = ["scene", "group", "experiment", "direction", "choice", "axis", "r", "error"]


@pytest.fixture
def table(tmp_path) -> pd.DataFrame:
    """Two sizes on two axes; the second choice meets the reference at the first size."""
    rows = [
        ("bar", "spring", "bar", "cumulative", choice, axis, r, error)
        for choice, errors in (("none", (1.0, 10.0)), ("all", (0.1, 10.0)))
        for axis in "xz"
        for r, error in zip((1, 2), errors, strict=True)
    ]
    part, stored = tmp_path / "part.csv", tmp_path / "stored.csv"
    write_table(pd.DataFrame(rows, columns=KEYS), part)
    columns = ["experiment", "group", "split", "num_points"]
    columns += [f"relative_error_{axis}" for axis in "xyz"]
    splits = ("train", 1), ("train", 2), ("test", 1), ("test", 2)
    reference = pd.DataFrame(
        [("bar", "spring", *split, 0.1, 5.0, np.nan) for split in splits], columns=columns
    )
    reference.to_csv(stored, index=False)  # as people edit it, without a checksum
    return published_choices([File(str(part), {})], stored)


def test_errors_stand_beside_the_stored_output(table):
    x = table[table.axis == "x"]
    assert (x.reference == 0.1).all()
    np.testing.assert_allclose(x.log_ratio, [1.0, 2.0, 0.0, 2.0])
    assert table[table.axis == "z"][["reference", "log_ratio"]].isna().all().all()


def test_distances_are_medians_and_curves_are_met_from_the_smallest_size(table):
    rows = published_distance(table).set_index("choice")
    assert rows.distance.tolist() == [1.5, 1.0]
    assert rows.largest.tolist() == [2.0, 2.0]
    assert rows.met.tolist() == [0, 1]
    assert (rows.sizes == 2).all()


def test_a_configuration_without_cases_has_empty_tables():
    assert published_distance(published_choices([], "stored.csv")).empty
