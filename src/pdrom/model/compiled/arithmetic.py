"""SIMD arithmetic of rows of four numbers: row with row, lane by lane, or row with number.

Operations are never reordered, so that the result of a lane does not depend on the other lanes.
A product and a sum are rounded once (fused) if the processor supports it.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from pdrom.model.compiled.rows import INDICES, NUMBERS, ROW, WIDTH


def spread(builder, number):
    """Return an LLVM vector that ``builder`` makes, with ``number`` in all lanes."""
    undefined = ir.Constant(NUMBERS, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(INDICES, [0] * WIDTH))


def multiply_add(builder, a, b, c):
    """Return the LLVM vector a b + c that ``builder`` makes, fused if the processor supports it."""
    kind = ir.FunctionType(NUMBERS, [NUMBERS] * 3)
    function = cgutils.get_or_insert_function(builder.module, kind, "llvm.fmuladd.v4f64")
    return builder.call(function, [a, b, c])


@intrinsic
def constant(_context, _number):
    """Return a row with the same number in all lanes."""

    def generate(_target, builder, _signature, arguments):
        return spread(builder, arguments[0])

    return ROW(types.float64), generate


def _lanewise(operation, name, description):
    def typed(_context, _a, _b):
        def generate(_target, builder, _signature, arguments):
            return getattr(builder, operation)(*arguments)

        return ROW(ROW, ROW), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = description
    return intrinsic(typed)


add = _lanewise("fadd", "add", "a + b.")
subtract = _lanewise("fsub", "subtract", "a - b.")
multiply = _lanewise("fmul", "multiply", "a b, lane by lane.")
divide = _lanewise("fdiv", "divide", "a / b, lane by lane.")


@intrinsic
def scaled(_context, _s, _b):
    """Product s b of a number s and a row b."""

    def generate(_target, builder, _signature, arguments):
        return builder.fmul(spread(builder, arguments[0]), arguments[1])

    return ROW(types.float64, ROW), generate


@intrinsic
def add_scaled(_context, _a, _s, _b):
    """Sum a + s b of rows a and b, with a number s."""

    def generate(_target, builder, _signature, arguments):
        a, s, b = arguments
        return multiply_add(builder, spread(builder, s), b, a)

    return ROW(ROW, types.float64, ROW), generate


@intrinsic
def add_product(_context, _a, _b, _c):
    """Sum a + b c of rows a, b and c, lane by lane."""

    def generate(_target, builder, _signature, arguments):
        a, b, c = arguments
        return multiply_add(builder, b, c, a)

    return ROW(ROW, ROW, ROW), generate


def _function_of_row(name, description):
    def typed(_context, _a):
        def generate(_target, builder, _signature, arguments):
            kind = ir.FunctionType(NUMBERS, [NUMBERS])
            full_name = f"llvm.{name}.v4f64"
            function = cgutils.get_or_insert_function(builder.module, kind, full_name)
            return builder.call(function, arguments)

        return ROW(ROW), generate

    typed.__name__ = typed.__qualname__ = name
    typed.__doc__ = description
    return intrinsic(typed)


square_root = _function_of_row("sqrt", "Square root, lane by lane.")
magnitude = _function_of_row("fabs", "Absolute value, lane by lane.")


@intrinsic
def total(_context, _row):
    """Sum of the four components of a row, added from the first to the last."""

    def generate(_target, builder, _signature, arguments):
        sums = builder.extract_element(arguments[0], ir.Constant(ir.IntType(32), 0))
        for lane in range(1, WIDTH):
            number = builder.extract_element(arguments[0], ir.Constant(ir.IntType(32), lane))
            sums = builder.fadd(sums, number)
        return sums

    return types.float64(ROW), generate


@intrinsic
def first_three(_context, _row):
    """Return the first three components of a row as a tuple of numbers."""
    result = types.UniTuple(types.float64, 3)

    def generate(context, builder, signature, arguments):
        lanes = [ir.Constant(ir.IntType(32), lane) for lane in range(3)]
        numbers = [builder.extract_element(arguments[0], lane) for lane in lanes]
        return context.make_tuple(builder, signature.return_type, numbers)

    return result(ROW), generate


@intrinsic
def of_three(_context, _x, _y, _z):
    """Return the row (x, y, z, 0)."""

    def generate(_target, builder, _signature, arguments):
        row = ir.Constant(NUMBERS, [0.0] * WIDTH)
        for lane, number in enumerate(arguments):
            row = builder.insert_element(row, number, ir.Constant(ir.IntType(32), lane))
        return row

    return ROW(types.float64, types.float64, types.float64), generate


def _within(builder, row, low, high):
    above = builder.fcmp_ordered(">=", row, spread(builder, low))
    below = builder.fcmp_ordered("<=", row, spread(builder, high))
    return builder.and_(above, below)


@intrinsic
def all_within(_context, _row, _low, _high):
    """Return whether all components lie in [low, high]; false if one of them is NaN."""

    def generate(_target, builder, _signature, arguments):
        inside = builder.bitcast(_within(builder, *arguments), ir.IntType(WIDTH))
        return builder.icmp_unsigned("==", inside, ir.Constant(ir.IntType(WIDTH), -1))

    return types.boolean(ROW, types.float64, types.float64), generate


@intrinsic
def choose_within(_context, _row, _low, _high, _a, _b):
    """Return a row with lane k of a where lane k of ``row`` is in [low, high], else of b."""

    def generate(_target, builder, _signature, arguments):
        row, low, high, a, b = arguments
        return builder.select(_within(builder, row, low, high), a, b)

    return ROW(ROW, types.float64, types.float64, ROW, ROW), generate


@intrinsic
def transposed(_context, _a, _b, _c, _d):
    """Return the four columns of the 4 x 4 matrix with the rows a, b, c, d."""
    result = types.UniTuple(ROW, WIDTH)

    def shuffle(builder, a, b, order):
        return builder.shuffle_vector(a, b, ir.Constant(INDICES, order))

    def generate(context, builder, signature, arguments):
        a, b, c, d = arguments
        low, high = shuffle(builder, a, b, [0, 4, 2, 6]), shuffle(builder, a, b, [1, 5, 3, 7])
        lower, higher = shuffle(builder, c, d, [0, 4, 2, 6]), shuffle(builder, c, d, [1, 5, 3, 7])
        columns = [
            shuffle(builder, low, lower, [0, 1, 4, 5]),
            shuffle(builder, high, higher, [0, 1, 4, 5]),
            shuffle(builder, low, lower, [2, 3, 6, 7]),
            shuffle(builder, high, higher, [2, 3, 6, 7]),
        ]
        return context.make_tuple(builder, signature.return_type, columns)

    return result(ROW, ROW, ROW, ROW), generate
