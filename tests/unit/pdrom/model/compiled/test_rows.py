"""Rows of four: where they begin, and which arrays share them."""

import numpy as np
import pytest

from pdrom.model.compiled import rows
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.lanes import LANES, pack, workspaces
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
        *workspaces(5),
    ]
    assert [array.ctypes.data % (8 * WIDTH) for array in arrays] == [0] * len(arrays)
    assert workspaces(5).shape == (2, 5 * LANES)


def test_a_view_of_rows_is_shared_and_nothing_else_is(rng):
    y = rows.as_vertices(rng.standard_normal((7, 3)))
    assert rows.shares(y, rows.flat(y))
    assert np.array_equal(rows.unflat(rows.flat(y)), y)
    others = [y.copy(), y[1:], y[::-1], y.base.reshape(-1, WIDTH)[:, 1:], np.asfortranarray(y)]
    for other in others:
        flat = rows.flat(other)
        assert not rows.shares(other, flat)
        assert np.array_equal(flat.reshape(-1, WIDTH)[:, :3], other)
        assert (flat[WIDTH - 1 :: WIDTH] == 0.0).all()
