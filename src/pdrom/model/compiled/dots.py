"""Inner products in compiled code.

Products of three matrix rows with a vector read the vector only once, and the processor prefetches
three rows. The order of summation does not depend on the processor: sixteen partial sums are added
to four, these to one, and the remaining terms one by one."""

from pdrom.model.compiled.arithmetic import (
    add,
    add_product,
    constant,
    first_three,
    of_three,
    total,
    transposed,
)
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at, load


@compiled(forceinline=True)
def _summed(a, b, c):
    """Return the sums of the components of three SIMD vectors as three numbers."""
    first, second, third, fourth = transposed(a, b, c, c)
    return first_three(add(add(first, third), add(second, fourth)))


@compiled(forceinline=True, fastmath={"contract"})
def dots(matrix, i, j, k, count, vector, starts):
    """Return ``starts`` (three numbers) plus the inner products of three rows with ``vector``.

    Parameters
    ----------
    matrix : flat array; the rows have ``count`` numbers each and begin at indices i, j and k
    """
    x, y, z = starts
    blocks, vectors = count - count % (4 * WIDTH), count - count % WIDTH
    if blocks:
        a, b, c = of_three(x, 0.0, 0.0), of_three(y, 0.0, 0.0), of_three(z, 0.0, 0.0)
        a1 = a2 = a3 = b1 = b2 = b3 = c1 = c2 = c3 = constant(0.0)
        for p in range(0, blocks, 4 * WIDTH):
            v = load(vector, p)
            a = add_product(a, load(matrix, i + p), v)
            b = add_product(b, load(matrix, j + p), v)
            c = add_product(c, load(matrix, k + p), v)
            q = p + WIDTH
            v = load(vector, q)
            a1 = add_product(a1, load(matrix, i + q), v)
            b1 = add_product(b1, load(matrix, j + q), v)
            c1 = add_product(c1, load(matrix, k + q), v)
            q = p + 2 * WIDTH
            v = load(vector, q)
            a2 = add_product(a2, load(matrix, i + q), v)
            b2 = add_product(b2, load(matrix, j + q), v)
            c2 = add_product(c2, load(matrix, k + q), v)
            q = p + 3 * WIDTH
            v = load(vector, q)
            a3 = add_product(a3, load(matrix, i + q), v)
            b3 = add_product(b3, load(matrix, j + q), v)
            c3 = add_product(c3, load(matrix, k + q), v)
        a, b, c = (
            add(add(a, a1), add(a2, a3)),
            add(add(b, b1), add(b2, b3)),
            add(add(c, c1), add(c2, c3)),
        )
        x, y, z = _summed(a, b, c)
    if vectors > blocks:
        a, b, c = of_three(x, 0.0, 0.0), of_three(y, 0.0, 0.0), of_three(z, 0.0, 0.0)
        for p in range(blocks, vectors, WIDTH):
            v = load(vector, p)
            a = add_product(a, load(matrix, i + p), v)
            b = add_product(b, load(matrix, j + p), v)
            c = add_product(c, load(matrix, k + p), v)
        x, y, z = _summed(a, b, c)
    for p in range(vectors, count):
        v = at(vector, p)
        x += at(matrix, i + p) * v
        y += at(matrix, j + p) * v
        z += at(matrix, k + p) * v
    return x, y, z


@compiled(nogil=True)
def dot(a, b):
    """Return the inner product of ``a`` and ``b`` (n,), by eight independent partial sums."""
    first = second = constant(0.0)
    whole = len(a) - len(a) % (2 * WIDTH)
    for k in range(0, whole, 2 * WIDTH):
        first = add_product(first, load(a, k), load(b, k))
        second = add_product(second, load(a, k + WIDTH), load(b, k + WIDTH))
    result = total(add(first, second))
    for k in range(whole, len(a)):
        result += a[k] * b[k]
    return result
