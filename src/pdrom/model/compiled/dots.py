"""Inner products in compiled code.

`dots` multiplies three matrix rows by a vector, which is read once for all three, and the processor
prefetches the rows. The order of summation does not depend on the processor: sixteen partial sums
of a row are reduced to four and these to one, to which the last terms (at most 15) are added."""

from pdrom.model.compiled import arithmetic
from pdrom.model.compiled.arithmetic import add, add_product, constant, of_three
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, at, load


@inner(forceinline=True)
def _summed(a, b, c):
    """Return three numbers: the sum of the four lanes of a, that of b and that of c."""
    first, second, third, fourth = arithmetic.transposed(a, b, c, c)
    return arithmetic.first_three(add(add(first, third), add(second, fourth)))


@inner(forceinline=True)
def _products(matrix, i, j, k, vector, p, sums):
    """Return the three rows ``sums`` plus, lane by lane, the products of entries p to p + 3 of the
    matrix rows that begin at i, j and k with these entries of ``vector``."""
    v = load(vector, p)
    return (
        add_product(sums[0], load(matrix, i + p), v),
        add_product(sums[1], load(matrix, j + p), v),
        add_product(sums[2], load(matrix, k + p), v),
    )


@inner(forceinline=True, fastmath={"contract"})
def dots(matrix, i, j, k, count, vector, starts):
    """Return ``starts`` (three numbers) plus the inner products of three rows with ``vector``.

    matrix : flat array; three rows of ``count`` numbers begin at the indices i, j and k
    """
    x, y, z = starts
    blocks, vectors = count - count % (4 * WIDTH), count - count % WIDTH
    if blocks:
        none = constant(0.0)
        r = of_three(x, 0.0, 0.0), of_three(y, 0.0, 0.0), of_three(z, 0.0, 0.0)
        s = t = u = (none, none, none)
        for p in range(0, blocks, 4 * WIDTH):
            r = _products(matrix, i, j, k, vector, p, r)
            s = _products(matrix, i, j, k, vector, p + WIDTH, s)
            t = _products(matrix, i, j, k, vector, p + 2 * WIDTH, t)
            u = _products(matrix, i, j, k, vector, p + 3 * WIDTH, u)
        x, y, z = _summed(
            add(add(r[0], s[0]), add(t[0], u[0])),
            add(add(r[1], s[1]), add(t[1], u[1])),
            add(add(r[2], s[2]), add(t[2], u[2])),
        )
    if vectors > blocks:
        r = of_three(x, 0.0, 0.0), of_three(y, 0.0, 0.0), of_three(z, 0.0, 0.0)
        for p in range(blocks, vectors, WIDTH):
            r = _products(matrix, i, j, k, vector, p, r)
        x, y, z = _summed(*r)
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
    result = arithmetic.total(add(first, second))
    for k in range(whole, len(a)):
        result += a[k] * b[k]
    return result
