"""Rows of four numbers, one row per vertex, which compiled code loads with one instruction.

The step loop stores positions and right-hand sides as (N, 4) arrays with a last column of zeros;
other code uses (N, 3) views of these "padded" arrays. Compiled code uses the flat array (4 N,) and
loads a row into a register of four lanes. A row may also hold one number of each of four elements
(`pdrom.model.compiled.arithmetic.transposed` converts between the two layouts).

Arrays of this module begin at multiples of the size of a row in memory. NumPy's arrays may not, so
that every second row may lie in two cache lines.

Loads and stores do not check indices; callers must not pass negative or too large ones.
"""

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import populate_array

from pdrom.model.compiled.functions import compiled

WIDTH = 4
ROW_BYTES = 8 * WIDTH

NUMBERS = ir.VectorType(ir.DoubleType(), WIDTH)
INDICES = ir.VectorType(ir.IntType(32), WIDTH)


class _RowType(types.Type):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__(name="RowOfFour")


ROW = _RowType()


@register_model(_RowType)
class _RowModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager, kind) -> None:
        super().__init__(manager, kind, NUMBERS)


def empty(numbers: int, dtype: type = np.float64) -> np.ndarray:
    """Return an uninitialised array (numbers,) at an address divisible by `ROW_BYTES`."""
    kind = np.dtype(dtype)
    memory = np.empty(numbers * kind.itemsize + ROW_BYTES, np.uint8)
    # no slice of ``memory``: ``base`` of its views would be ``memory``, but `flat` needs the array
    start = -memory.ctypes.data % ROW_BYTES
    return np.frombuffer(memory.data, kind, numbers, start)


def zeros(numbers: int) -> np.ndarray:
    """Return an array (numbers,) of zeros at an address divisible by `ROW_BYTES`."""
    made = empty(numbers)
    made.fill(0.0)
    return made


def copied(numbers: np.ndarray) -> np.ndarray:
    """Return a copy of the flat array ``numbers`` at an address divisible by `ROW_BYTES`."""
    made = empty(len(numbers), numbers.dtype.type)
    made[...] = numbers
    return made


@compiled(nogil=True)
def write(numbers, to):
    """Copy the flat array ``numbers`` into ``to``, which is at least as long.

    The compiled step loop uses this function, since an assignment to a slice (with its error
    message) takes seconds to compile.
    """
    for i in range(len(numbers)):
        to[i] = numbers[i]


def vertices(count: int) -> np.ndarray:
    """Return zeros (count, 3), a view of an array (count, 4) whose last column is padding."""
    return unflat(zeros(WIDTH * count))


def as_vertices(values: np.ndarray) -> np.ndarray:
    """Return a copy (N, 3) of ``values``, a view of a new array (N, 4) with a last column of 0."""
    copy = vertices(len(values))
    copy[...] = values
    return copy


def flat(values: np.ndarray) -> np.ndarray:
    """Return ``values`` (N, 3) as (4 N,), zero after each row; a view if memory has these zeros."""
    rows = values.base
    if (
        isinstance(rows, np.ndarray)
        and rows.size == WIDTH * len(values)
        and rows.flags.c_contiguous
        and rows.dtype == np.float64
        and values.strides == (8 * WIDTH, 8)
        and _same_start(values, rows)
    ):
        return rows.reshape(-1)
    copy = zeros(WIDTH * len(values))
    unflat(copy)[...] = values
    return copy


def unflat(rows: np.ndarray) -> np.ndarray:
    """Return a view (N, 3), without the padding zeros, of the flat array ``rows`` (4 N,)."""
    return rows.reshape(-1, WIDTH)[:, :3]


def shares(values: np.ndarray, rows: np.ndarray) -> bool:
    """Return whether ``rows``, which `flat` returned for ``values`` (N, 3), shares their memory."""
    return len(values) > 0 and _same_start(values, rows)


@compiled
def _same_start(a, b):
    """Return whether two arrays begin at the same address, faster than NumPy does."""
    return a.ctypes.data == b.ctypes.data


def _element(context, builder, kind, array, index):
    return builder.gep(context.make_array(kind)(context, builder, array).data, [index])


def _place(context, builder, kind, array, index):
    pointer = _element(context, builder, kind, array, index)
    return builder.bitcast(pointer, NUMBERS.as_pointer())


@intrinsic
def at(_context, array, index):
    """Return array[index] without a bounds check; an integer entry is converted to intp."""
    result = types.intp if isinstance(array.dtype, types.Integer) else array.dtype

    def generate(context, builder, signature, arguments):
        value = builder.load(_element(context, builder, signature.args[0], *arguments))
        return context.cast(builder, value, signature.args[0].dtype, signature.return_type)

    return result(array, types.intp), generate


@intrinsic
def load(_context, array, index):
    """Return the row of four numbers of the flat ``array`` that begins at ``index``."""

    def generate(context, builder, signature, arguments):
        return builder.load(_place(context, builder, signature.args[0], *arguments), align=8)

    return ROW(array, types.intp), generate


@intrinsic
def store(_context, array, index, _row):
    """Write a row of four numbers to the flat ``array`` from ``index`` on."""

    def generate(context, builder, signature, arguments):
        array, index, row = arguments
        builder.store(row, _place(context, builder, signature.args[0], array, index), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, ROW), generate


def _view(kind):
    """Return f(address, count): an array over numbers in memory; carray compiles more slowly."""

    def typed(_context, _address, _count):
        def generate(context, builder, signature, arguments):
            made = context.make_array(signature.return_type)(context, builder)
            size = context.get_constant(types.intp, kind.bitwidth // 8)
            data = builder.inttoptr(arguments[0], made.data.type)
            populate_array(made, data, [arguments[1]], [size], size, None)
            return made._getvalue()

        return types.Array(kind, 1, "C")(types.intp, types.intp), generate

    return intrinsic(typed)


doubles, integers, indices = _view(types.float64), _view(types.int32), _view(types.int64)
