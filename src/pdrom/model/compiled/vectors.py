"""Long vectors in compiled code."""

from pdrom.model.compiled.arithmetic import add, add_product, constant, total
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, load


@compiled(nogil=True)
def dot(a, b):
    """Inner product of ``a`` and ``b`` (n,), in eight sums that do not wait for each other."""
    first = second = constant(0.0)
    whole = len(a) - len(a) % (2 * WIDTH)
    for k in range(0, whole, 2 * WIDTH):
        first = add_product(first, load(a, k), load(b, k))
        second = add_product(second, load(a, k + WIDTH), load(b, k + WIDTH))
    result = total(add(first, second))
    for k in range(whole, len(a)):
        result += a[k] * b[k]
    return result


@compiled(nogil=True)
def add_multiple(a, s, b):
    """a <- a + s b."""
    for k in range(len(a)):
        a[k] += s * b[k]
