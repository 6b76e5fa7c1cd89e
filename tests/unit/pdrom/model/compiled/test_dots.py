"""Products of three rows with a vector: of whole numbers, every order of the sums is exact."""

import numpy as np
import pytest

from pdrom.model.compiled.dots import dots
from pdrom.model.compiled.functions import compiled


@compiled
def _of(matrix, rows, count, vector, starts):
    return dots(matrix, rows[0], rows[1], rows[2], count, vector, starts)


@pytest.mark.parametrize("rows", [(0, 1, 2), (4, 0, 3), (2, 2, 2)])
def test_rows_of_every_length(rows, rng):
    for count in range(41):
        matrix = rng.integers(-99, 99, (5, count)).astype(float)
        vector = rng.integers(-99, 99, count).astype(float)
        starts = (7.0, -3.0, 0.0)
        begins = tuple(count * row for row in rows)
        found = _of(matrix.ravel(), begins, count, vector, starts)
        assert found == tuple(matrix[list(rows)] @ vector + starts)


@pytest.mark.parametrize("place", [0, 17, 36])
def test_what_is_not_a_number_stays_in_its_row(place):
    matrix = np.ones((3, 37))
    matrix[1, place] = np.nan
    found = _of(matrix.ravel(), (0, 37, 74), 37, np.ones(37), (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(found, (37.0, np.nan, 37.0))
