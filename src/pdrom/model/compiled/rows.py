"""Vertices as rows of four numbers, so that compiled code moves one with a single instruction.

The step loop keeps positions and right-hand sides as (N, 4) with a last column of zeros; outside
they are (N, 3) views of these. Compiled code sees the flat array and holds a row in a register of
four lanes. A row may also hold one number of four elements
(`pdrom.model.compiled.arithmetic.transposed` goes from one to the other).

Arrays of rows are made here, at multiples of a row's size: NumPy's own begin in the middle of one,
and every second row then straddles two lines of the cache.

Loads and stores check nothing: indices are neither negative nor too large.
"""

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic, models, register_model

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
    """Uninitialised aligned array (numbers,) of doubles, or of another ``dtype``."""
    kind = np.dtype(dtype)
    memory = np.empty(numbers * kind.itemsize + ROW_BYTES, np.uint8)
    # through a memoryview: views of what is returned have that as their base, not the memory
    start = -memory.ctypes.data % ROW_BYTES
    return np.frombuffer(memory.data, kind, numbers, start)


def zeros(numbers: int) -> np.ndarray:
    """Aligned array (numbers,) of zeros."""
    made = empty(numbers)
    made.fill(0.0)
    return made


def copied(numbers: np.ndarray) -> np.ndarray:
    """Aligned copy of the flat array ``numbers``."""
    made = empty(len(numbers), numbers.dtype.type)
    made[...] = numbers
    return made


@compiled(nogil=True)
def write(numbers, to):
    """Copy the flat array ``numbers`` into ``to``, which is at least as long.

    The loops of every frame assign no array to a slice: the message about shapes that could differ
    takes seconds to compile.
    """
    for i in range(len(numbers)):
        to[i] = numbers[i]


def vertices(count: int) -> np.ndarray:
    """Zeros (count, 3), as a view of a padded array (count, 4)."""
    return unflat(zeros(WIDTH * count))


def as_vertices(values: np.ndarray) -> np.ndarray:
    """Copy of the values (N, 3), as a view of a padded array (N, 4)."""
    copy = vertices(len(values))
    copy[...] = values
    return copy


def flat(values: np.ndarray) -> np.ndarray:
    """Return ``values`` (N, 3) padded and flat, (4 N,): without a copy if they are such a view."""
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
    """Flat ``rows`` (4 N,) of four as a view (N, 3), the opposite of `flat`."""
    return rows.reshape(-1, WIDTH)[:, :3]


def shares(values: np.ndarray, rows: np.ndarray) -> bool:
    """Whether ``rows``, the result of `flat` for ``values`` (N, 3), shares their memory."""
    return len(values) > 0 and _same_start(values, rows)


@compiled
def _same_start(a, b):
    """Whether two arrays begin at the same address; faster than a comparison with NumPy."""
    return a.ctypes.data == b.ctypes.data


def _element(context, builder, kind, array, index):
    return builder.gep(context.make_array(kind)(context, builder, array).data, [index])


def _place(context, builder, kind, array, index):
    pointer = _element(context, builder, kind, array, index)
    return builder.bitcast(pointer, NUMBERS.as_pointer())


@intrinsic
def at(_context, array, index):
    """array[index], an integer widened to the size of an index."""
    result = types.intp if isinstance(array.dtype, types.Integer) else array.dtype

    def generate(context, builder, signature, arguments):
        value = builder.load(_element(context, builder, signature.args[0], *arguments))
        return context.cast(builder, value, signature.args[0].dtype, signature.return_type)

    return result(array, types.intp), generate


@intrinsic
def load(_context, array, index):
    """The row of the flat ``array`` that begins at ``index``."""

    def generate(context, builder, signature, arguments):
        return builder.load(_place(context, builder, signature.args[0], *arguments), align=8)

    return ROW(array, types.intp), generate


@intrinsic
def store(_context, array, index, _row):
    """Write a row to the flat ``array`` from ``index`` on."""

    def generate(context, builder, signature, arguments):
        array, index, row = arguments
        builder.store(row, _place(context, builder, signature.args[0], array, index), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, ROW), generate


@intrinsic
def _pointer(_context, _address):
    def generate(_target, builder, _signature, arguments):
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.intp), generate


@compiled(inline="always")
def doubles(address, count):
    """Array (count,) of the doubles at an address."""
    return carray(_pointer(address), (count,), np.float64)


@compiled(inline="always")
def integers(address, count):
    """Array (count,) of the int32 at an address."""
    return carray(_pointer(address), (count,), np.int32)


@compiled(inline="always")
def indices(address, count):
    """Array (count,) of the int64 at an address."""
    return carray(_pointer(address), (count,), np.int64)
