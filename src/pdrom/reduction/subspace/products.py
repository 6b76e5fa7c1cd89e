"""Products of small dense matrices with vectors, and projections, in compiled loops of a subspace.

The matrix of a product is stored in blocks of `TALL` rows, each block column by column, so that the
sums of all rows of a block are computed side by side, in the order of the columns. Vectors are read
and written four numbers at a time, although they have three: arrays of `vectors` have space.
"""

import numpy as np

from pdrom.model.compiled.arithmetic import add_scaled
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, at, copied, load, store, zeros
from pdrom.model.constraints.local_kernel import call_gradients

TALL = 8


def blocks(matrix: np.ndarray) -> np.ndarray:
    """Arrange ``matrix`` (m, n) in blocks for `product`, flat; zero rows fill the last block."""
    m, n = matrix.shape
    whole = np.zeros((-(-m // TALL) * TALL, n))
    whole[:m] = matrix
    return copied(whole.reshape(len(whole) // TALL, TALL, n).transpose(0, 2, 1).ravel())


def vectors(count: int) -> np.ndarray:
    """Return zeros, flat, for ``count`` vectors of three numbers, padded as `product` requires."""
    return zeros(3 * (-(-count // TALL) * TALL) + WIDTH)


@compiled(nogil=True)
def product(matrix, m, n, start, x, out):
    """Set ``out`` = ``start`` + M ``x``; M (m, n) comes from `blocks`, arrays from `vectors`."""
    entry = 0
    for row in range(0, 3 * m, 3 * TALL):
        a, b, c = load(start, row), load(start, row + 3), load(start, row + 6)
        d, e, f = load(start, row + 9), load(start, row + 12), load(start, row + 15)
        g, h = load(start, row + 18), load(start, row + 21)
        for k in range(0, 3 * n, 3):
            v = load(x, k)
            a, b = add_scaled(a, at(matrix, entry), v), add_scaled(b, at(matrix, entry + 1), v)
            c, d = add_scaled(c, at(matrix, entry + 2), v), add_scaled(d, at(matrix, entry + 3), v)
            e, f = add_scaled(e, at(matrix, entry + 4), v), add_scaled(f, at(matrix, entry + 5), v)
            g, h = add_scaled(g, at(matrix, entry + 6), v), add_scaled(h, at(matrix, entry + 7), v)
            entry += TALL
        # the fourth number stored for each vector is overwritten by the next vector
        for total in (a, b, c, d, e, f, g, h):
            store(out, row, total)
            row += 3


@inner
def project(strain, rows, size, offset, z, sampled):
    """Write S q of all sampled elements at coordinates ``z``, and its projections, to ``sampled``.

    Arguments are those of `run_iterations`, which names them.
    """
    addresses, elements, starts, parameters, parameter_starts, d, p = sampled
    product(strain, rows, size, offset, z, d)
    for g in range(len(addresses)):
        call_gradients(
            addresses[g],
            d[3 * starts[g] :].ctypes.data,
            parameters[parameter_starts[g] :].ctypes.data,
            p[3 * starts[g] :].ctypes.data,
            elements[g],
        )


@inner
def objective(weights, d, p, inertia, y, s):
    """Return E(y) = 1/2 sum_i w_i |d_i - p_i|^2 + 1/2 (y - s)^T (M/h^2) (y - s), J; d = S q."""
    total = 0.0
    for i in range(len(weights)):
        for axis in range(3):
            total += weights[i] * (d[3 * i + axis] - p[3 * i + axis]) ** 2
    for i in range(len(inertia)):
        for axis in range(3):
            moved = 0.0
            for k in range(i):
                moved += inertia[i, k] * (y[3 * k + axis] - s[3 * k + axis])
            own = y[3 * i + axis] - s[3 * i + axis]
            total += own * (2.0 * moved + inertia[i, i] * own)
    return 0.5 * total
