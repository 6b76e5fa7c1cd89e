"""Products of small dense matrices with vectors of x, y and z, in registers.

A matrix lies in blocks of `TALL` rows, column by column, so that a column of a block meets a vector
in `TALL` products that do not wait for each other. Vectors are three numbers each, one after the
other, and are read and written four numbers at a time: their arrays are longer by what that needs
(`vectors`). The order of every sum is that of the columns, whatever the processor.
"""

import numpy as np

from pdrom.model.compiled.arithmetic import add_scaled
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at, copied, load, store, zeros

TALL = 8


def blocks(matrix: np.ndarray) -> np.ndarray:
    """A matrix (m, n) as the blocks of `product`, flat; rows of zeros fill up the last one."""
    m, n = matrix.shape
    whole = np.zeros((-(-m // TALL) * TALL, n))
    whole[:m] = matrix
    return copied(
        np.ascontiguousarray(whole.reshape(len(whole) // TALL, TALL, n).transpose(0, 2, 1)).ravel()
    )


def vectors(count: int) -> np.ndarray:
    """Zeros for ``count`` vectors, to be read and written by `product`."""
    return zeros(3 * (-(-count // TALL) * TALL) + WIDTH)


def write(values: np.ndarray, to: np.ndarray) -> None:
    """Copy vectors ``values`` (n, 3) ``to`` where `product` reads them."""
    to[: values.size] = values.ravel()


def read(vectors: np.ndarray, count: int) -> np.ndarray:
    """The first ``count`` of ``vectors`` as a view (count, 3)."""
    return vectors[: 3 * count].reshape(count, 3)


@compiled(nogil=True)
def product(matrix, m, n, start, x, out):
    """Write ``start`` + M ``x`` into ``out``, `vectors`; ``matrix`` M (m, n) is in `blocks`."""
    entry = 0
    for row in range(0, 3 * m, 3 * TALL):
        a, b = load(start, row), load(start, row + 3)
        c, d = load(start, row + 6), load(start, row + 9)
        e, f = load(start, row + 12), load(start, row + 15)
        g, h = load(start, row + 18), load(start, row + 21)
        for k in range(0, 3 * n, 3):
            v = load(x, k)
            a, b = add_scaled(a, at(matrix, entry), v), add_scaled(b, at(matrix, entry + 1), v)
            c, d = add_scaled(c, at(matrix, entry + 2), v), add_scaled(d, at(matrix, entry + 3), v)
            e, f = add_scaled(e, at(matrix, entry + 4), v), add_scaled(f, at(matrix, entry + 5), v)
            g, h = add_scaled(g, at(matrix, entry + 6), v), add_scaled(h, at(matrix, entry + 7), v)
            entry += TALL
        # the fourth lane of each is overwritten by the next one
        store(out, row, a)
        store(out, row + 3, b)
        store(out, row + 6, c)
        store(out, row + 9, d)
        store(out, row + 12, e)
        store(out, row + 15, f)
        store(out, row + 18, g)
        store(out, row + 21, h)
