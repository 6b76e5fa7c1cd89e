"""SIMD arithmetic of rows of four numbers: row with row, lane by lane, or row with number.

Operations are never reordered, so that the result of a lane does not depend on the other lanes.
A product and a sum are rounded once (fused) if the processor supports it.
"""

from functools import wraps

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from pdrom.model.compiled.rows import INDICES, NUMBERS, ROW, WIDTH

_NUMBER = types.float64


def spread(builder, number):
    """Return an LLVM vector that ``builder`` makes, with ``number`` in all lanes."""
    undefined = ir.Constant(NUMBERS, ir.Undefined)
    first = builder.insert_element(undefined, number, _lane(0))
    return builder.shuffle_vector(first, undefined, ir.Constant(INDICES, [0] * WIDTH))


def multiply_add(builder, a, b, c):
    """Return the LLVM vector a b + c that ``builder`` makes, fused if the processor supports it."""
    return _call(builder, "fmuladd", a, b, c)


def _call(builder, name, *vectors):
    kind = ir.FunctionType(NUMBERS, [NUMBERS] * len(vectors))
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v4f64")
    return builder.call(function, vectors)


def _lane(number):
    return ir.Constant(ir.IntType(32), number)


def _operation(result, *kinds):
    """Return a decorator of ``write(builder, *arguments)``, which makes an LLVM value.

    The decorated function is an intrinsic with arguments of these ``kinds`` and this ``result``.
    """

    def decorate(write):
        @wraps(write)
        def typed(_context, *_kinds):
            return result(*kinds), lambda _target, builder, _signature, own: write(builder, *own)

        return intrinsic(typed)

    return decorate


@_operation(ROW, _NUMBER)
def constant(builder, number):
    """Return a row with the same number in all lanes."""
    return spread(builder, number)


@_operation(ROW, ROW, ROW)
def add(builder, a, b):
    """a + b."""
    return builder.fadd(a, b)


@_operation(ROW, ROW, ROW)
def subtract(builder, a, b):
    """a - b."""
    return builder.fsub(a, b)


@_operation(ROW, ROW, ROW)
def multiply(builder, a, b):
    """a b, lane by lane."""
    return builder.fmul(a, b)


@_operation(ROW, ROW, ROW)
def divide(builder, a, b):
    """a / b, lane by lane."""
    return builder.fdiv(a, b)


@_operation(ROW, _NUMBER, ROW)
def scaled(builder, s, b):
    """Product s b of a number s and a row b."""
    return builder.fmul(spread(builder, s), b)


@_operation(ROW, ROW, _NUMBER, ROW)
def add_scaled(builder, a, s, b):
    """Sum a + s b of rows a and b, with a number s."""
    return multiply_add(builder, spread(builder, s), b, a)


@_operation(ROW, ROW, ROW, ROW)
def add_product(builder, a, b, c):
    """Sum a + b c of rows a, b and c, lane by lane."""
    return multiply_add(builder, b, c, a)


@_operation(ROW, ROW)
def square_root(builder, a):
    """Square root, lane by lane."""
    return _call(builder, "sqrt", a)


@_operation(ROW, ROW)
def magnitude(builder, a):
    """Absolute value, lane by lane."""
    return _call(builder, "fabs", a)


@_operation(_NUMBER, ROW)
def total(builder, row):
    """Sum of the four components of a row, added from the first to the last."""
    sums = builder.extract_element(row, _lane(0))
    for lane in range(1, WIDTH):
        sums = builder.fadd(sums, builder.extract_element(row, _lane(lane)))
    return sums


@_operation(types.UniTuple(_NUMBER, 3), ROW)
def first_three(builder, row):
    """Return the first three components of a row as a tuple of numbers."""
    numbers = [builder.extract_element(row, _lane(lane)) for lane in range(3)]
    return cgutils.pack_array(builder, numbers)


@_operation(ROW, _NUMBER, _NUMBER, _NUMBER)
def of_three(builder, x, y, z):
    """Return the row (x, y, z, 0)."""
    row = ir.Constant(NUMBERS, [0.0] * WIDTH)
    for lane, number in enumerate((x, y, z)):
        row = builder.insert_element(row, number, _lane(lane))
    return row


def _within(builder, row, low, high):
    above = builder.fcmp_ordered(">=", row, spread(builder, low))
    below = builder.fcmp_ordered("<=", row, spread(builder, high))
    return builder.and_(above, below)


@_operation(types.boolean, ROW, _NUMBER, _NUMBER)
def all_within(builder, row, low, high):
    """Return whether all components lie in [low, high]; false if one of them is NaN."""
    inside = builder.bitcast(_within(builder, row, low, high), ir.IntType(WIDTH))
    return builder.icmp_unsigned("==", inside, ir.Constant(ir.IntType(WIDTH), -1))


@_operation(ROW, ROW, _NUMBER, _NUMBER, ROW, ROW)
def choose_within(builder, row, low, high, a, b):
    """Return a row with lane k of a where lane k of ``row`` is in [low, high], else of b."""
    return builder.select(_within(builder, row, low, high), a, b)


@_operation(types.UniTuple(ROW, WIDTH), ROW, ROW, ROW, ROW)
def transposed(builder, a, b, c, d):
    """Return the four columns of the 4 x 4 matrix with the rows a, b, c, d."""

    def shuffle(a, b, *order):
        return builder.shuffle_vector(a, b, ir.Constant(INDICES, order))

    low, high = shuffle(a, b, 0, 4, 2, 6), shuffle(a, b, 1, 5, 3, 7)
    lower, higher = shuffle(c, d, 0, 4, 2, 6), shuffle(c, d, 1, 5, 3, 7)
    columns = [
        shuffle(low, lower, 0, 1, 4, 5),
        shuffle(high, higher, 0, 1, 4, 5),
        shuffle(low, lower, 2, 3, 6, 7),
        shuffle(high, higher, 2, 3, 6, 7),
    ]
    return cgutils.pack_array(builder, columns)
