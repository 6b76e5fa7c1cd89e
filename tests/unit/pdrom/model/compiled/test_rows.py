"""Padded rows of four: alignment, shared arrays, and products of three entries with a vector.

Products of integers are exact in every order of summation.
"""

import numpy as np
import pytest

from pdrom.model.compiled import rows
from pdrom.model.compiled.dots import dots
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.lanes import pack, workspace
from pdrom.model.dynamics.frames import predict, weighted


@pytest.mark.parametrize("count", [1, 3, 400, 20_000])
def test_arrays_of_rows_begin_at_a_multiple_of_a_row(count, rng):
    q, v = rng.standard_normal((2, count, 3))
    s = predict(q, v, np.zeros((1, 3)), 0.1)
    arrays = [
        rows.empty(WIDTH * count),
        rows.zeros(WIDTH * count),
        rows.copied(s),
        rows.flat(q),
        rows.flat(rows.vertices(count)),
        rows.flat(rows.as_vertices(q)),
        s,
        weighted(np.ones(count), s),
        pack(q),
        workspace(5),
    ]
    assert [array.ctypes.data % (8 * WIDTH) for array in arrays] == [0] * len(arrays)


def test_only_a_view_of_rows_is_shared(rng):
    y = rows.as_vertices(rng.standard_normal((7, 3)))
    assert rows.shares(y, rows.flat(y))
    assert np.array_equal(rows.unflat(rows.flat(y)), y)
    others = [y.copy(), y[1:], y[::-1], y.base.reshape(-1, WIDTH)[:, 1:], np.asfortranarray(y)]
    for other in others:
        flat = rows.flat(other)
        assert not rows.shares(other, flat)
        assert np.array_equal(flat.reshape(-1, WIDTH)[:, :3], other)
        assert (flat[WIDTH - 1 :: WIDTH] == 0.0).all()


@compiled
def _of(matrix, rows, count, vector, starts):
    return dots(matrix, rows[0], rows[1], rows[2], count, vector, starts)


@pytest.mark.parametrize("rows", [(0, 1, 2), (4, 0, 3), (2, 2, 2)])
def test_products_are_exact_for_rows_of_every_length(rows, rng):
    for count in range(41):
        matrix = rng.integers(-99, 99, (5, count)).astype(float)
        vector = rng.integers(-99, 99, count).astype(float)
        starts = (7.0, -3.0, 0.0)
        begins = tuple(count * row for row in rows)
        found = _of(matrix.ravel(), begins, count, vector, starts)
        assert found == tuple(matrix[list(rows)] @ vector + starts)


@pytest.mark.parametrize("place", [0, 17, 36])
def test_a_nan_stays_in_its_row(place):
    matrix = np.ones((3, 37))
    matrix[1, place] = np.nan
    found = _of(matrix.ravel(), (0, 37, 74), 37, np.ones(37), (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(found, (37.0, np.nan, 37.0))
