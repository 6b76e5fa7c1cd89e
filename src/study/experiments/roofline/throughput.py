"""Loops that do one thing as fast as a thread can: read, or compute in independent vectors."""

from pdrom.model.compiled.arithmetic import (
    add,
    add_product,
    constant,
    divide,
    square_root,
    total,
)
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, load

AT_ONCE = 8  # independent vectors, enough to hide the latency of what is measured


@compiled(nogil=True)
def read(numbers, times):
    """Sum of the numbers, a multiple of 32 of them, ``times`` times."""
    a, b, c, d = constant(0.0), constant(0.0), constant(0.0), constant(0.0)
    e, f, g, h = constant(0.0), constant(0.0), constant(0.0), constant(0.0)
    for _ in range(times):
        for i in range(0, len(numbers), AT_ONCE * WIDTH):
            a, b = add(a, load(numbers, i)), add(b, load(numbers, i + WIDTH))
            c, d = add(c, load(numbers, i + 2 * WIDTH)), add(d, load(numbers, i + 3 * WIDTH))
            e, f = add(e, load(numbers, i + 4 * WIDTH)), add(f, load(numbers, i + 5 * WIDTH))
            g, h = add(g, load(numbers, i + 6 * WIDTH)), add(h, load(numbers, i + 7 * WIDTH))
    return total(add(add(add(a, b), add(c, d)), add(add(e, f), add(g, h))))


@compiled(nogil=True)
def chain(times):
    """The end of so many ``times`` x <- x / 2 + 1, each of which waits for the one before."""
    x = 0.0
    for _ in range(times):
        x = 0.5 * x + 1.0
    return x


def _chains(step):
    """A function that takes ``step(x, one)`` so many times in `AT_ONCE` independent vectors."""

    @compiled(nogil=True)
    def run(numbers, times):
        one = load(numbers, 0)
        a, b = load(numbers, WIDTH), load(numbers, 2 * WIDTH)
        c, d = load(numbers, 3 * WIDTH), load(numbers, 4 * WIDTH)
        e, f = load(numbers, 5 * WIDTH), load(numbers, 6 * WIDTH)
        g, h = load(numbers, 7 * WIDTH), load(numbers, 8 * WIDTH)
        for _ in range(times):
            a, b, c, d = step(a, one), step(b, one), step(c, one), step(d, one)
            e, f, g, h = step(e, one), step(f, one), step(g, one), step(h, one)
        return total(add(add(add(a, b), add(c, d)), add(add(e, f), add(g, h))))

    return run


@compiled(forceinline=True)
def _multiplied(x, one):
    return add_product(one, x, one)


@compiled(forceinline=True)
def _divided(x, one):
    return divide(one, x)


@compiled(forceinline=True)
def _rooted(x, one):
    return square_root(add(x, one))


products = _chains(_multiplied)
divisions = _chains(_divided)
roots = _chains(_rooted)
