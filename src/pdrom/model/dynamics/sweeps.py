"""Forward and backward substitution by panels, for three right-hand sides (x, y, z) at once.

A panel is a set of consecutive columns of L in A = L D L^T, see module `solvers`. A row of the
right-hand side fills a register of four numbers, so that an entry of L is read once for x, y and z.
Instructions are unrolled for each width, to keep the unknowns of a panel in registers.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from pdrom.model.compiled.arithmetic import multiply_add, spread, subtract
from pdrom.model.compiled.functions import Callback, caller, compiled
from pdrom.model.compiled.rows import NUMBERS, WIDTH, at, doubles, indices, integers, store
from pdrom.model.compiled.rows import load as load_row

_INDEX = ir.IntType(64)
# Allowed numbers of columns of a panel.
WIDTHS = (1, 2, 3, 4, 6, 8)


class _Panel:
    """Writer of the LLVM instructions for a panel of ``width`` columns of the factor L.

    ``arguments`` are those of `_panel_intrinsic`, as LLVM values.
    """

    def __init__(self, context, builder, signature, arguments, width):
        _, x, first, rows, start, stop, values, value_start = arguments
        self.builder, self.width = builder, width
        self._x = context.make_array(signature.args[1])(context, builder, x).data
        self._first = first
        self._rows = context.make_array(signature.args[3])(context, builder, rows).data
        self._start, self._stop = start, stop
        numbers = context.make_array(signature.args[6])(context, builder, values).data
        self._own = builder.gep(numbers, [value_start])
        self._below = builder.gep(self._own, [self._index(width + width * (width - 1) // 2)])

    def _index(self, number):
        return ir.Constant(_INDEX, number)

    def _spread(self, pointer, offset):
        return spread(self.builder, self.builder.load(self.builder.gep(pointer, [offset])))

    def inverse(self, column):
        """Return 1 / (entry of D in L D L^T) for ``column``, in all four numbers of a register."""
        return self._spread(self._own, self._index(column))

    def triangle(self, row, column):
        """Return an entry of L in the panel's strict lower triangle, repeated in a register."""
        return self._spread(self._own, self._index(self.width + row * (row - 1) // 2 + column))

    def pointer(self, offset):
        """Return the address of the right-hand side's row that begins at its entry ``offset``."""
        return self.builder.bitcast(self.builder.gep(self._x, [offset]), NUMBERS.as_pointer())

    def column(self, k):
        """Return the address of the right-hand side's row that belongs to column k of the panel."""
        return self.pointer(self.builder.add(self._first, self._index(WIDTH * k)))

    def load(self, pointer):
        return self.builder.load(pointer, align=8)

    def store(self, row, pointer):
        self.builder.store(row, pointer, align=8)

    def less(self, a, entry, b):
        """Return a - entry * b for registers of four numbers, number by number."""
        return multiply_add(self.builder, self.builder.fneg(entry), b, a)

    def rows_below(self):
        """Generate a loop over the rows of factor L below the panel's triangle; callers add a body.

        Yield the address of each row of the right-hand side and a function: panel column -> entry.
        """
        builder = self.builder
        with cgutils.for_range_slice(builder, self._start, self._stop, self._index(1)) as (k, _):
            row = builder.sext(builder.load(builder.gep(self._rows, [k])), _INDEX)
            begin = builder.mul(builder.sub(k, self._start), self._index(self.width))
            entries = builder.gep(self._below, [begin])
            yield self.pointer(row), lambda column: self._spread(entries, self._index(column))


def _panel_intrinsic(write):
    """Return a Numba intrinsic for a panel of L; ``write(panel)`` generates its instructions."""

    def typed(_context, width, x, first, rows, start, stop, values, value_start):
        def generate(context, builder, signature, arguments):
            after = builder.append_basic_block("after")
            switch = builder.switch(arguments[0], after)
            for columns in WIDTHS:
                block = builder.append_basic_block(f"panel.{columns}")
                switch.add_case(ir.Constant(_INDEX, columns), block)
                builder.position_at_end(block)
                write(_Panel(context, builder, signature, arguments, columns))
                builder.branch(after)
            builder.position_at_end(after)
            return context.get_dummy_value()

        index = types.intp
        return types.void(index, x, index, rows, index, index, values, index), generate

    typed.__name__ = typed.__qualname__ = write.__name__
    return intrinsic(typed)


def _write_forward(panel):
    """Generate code that does x <- L^-1 x for the panel's columns, then updates the rows below."""
    columns: list[ir.Value] = []
    for row in range(panel.width):
        value = panel.load(panel.column(row))
        for column in range(row):
            value = panel.less(value, panel.triangle(row, column), columns[column])
        if row:
            panel.store(value, panel.column(row))
        columns.append(value)
    for pointer, entry in panel.rows_below():
        # with two partial sums, the chain of dependent additions is half as long
        sums = [panel.load(pointer), None]
        for k, column in enumerate(columns):
            if sums[k % 2] is None:
                sums[1] = panel.builder.fmul(panel.builder.fneg(entry(k)), column)
            else:
                sums[k % 2] = panel.less(sums[k % 2], entry(k), column)
        total = sums[0] if sums[1] is None else panel.builder.fadd(sums[0], sums[1])
        panel.store(total, pointer)


def _write_backward(panel):
    """Generate code of x <- L^-T D^-1 x for the panel: scale by D, subtract rows below, solve."""
    builder = panel.builder
    slots = []
    for k in range(panel.width):
        slots.append(cgutils.alloca_once(builder, NUMBERS))
        scaled = builder.fmul(panel.inverse(k), panel.load(panel.column(k)))
        builder.store(scaled, slots[k])
    for pointer, entry in panel.rows_below():
        row = panel.load(pointer)
        for k, slot in enumerate(slots):
            builder.store(panel.less(builder.load(slot), entry(k), row), slot)
    columns = [builder.load(slot) for slot in slots]
    for column in reversed(range(panel.width)):
        for row in reversed(range(column + 1, panel.width)):
            entry = panel.triangle(row, column)
            columns[column] = panel.less(columns[column], entry, columns[row])
        panel.store(columns[column], panel.column(column))


_forward = _panel_intrinsic(_write_forward)
_backward = _panel_intrinsic(_write_backward)


@compiled(nogil=True)
def load(beside, indptr, indices, data, targets, loads):
    """Write the product of a coupling matrix and ``targets`` to the rows ``beside`` of ``loads``.

    The CSR matrix (``indptr``, ``indices``, ``data``) couples unknowns to held vertices, which have
    ``targets`` (m, 3) m; its rows ``beside`` are those with entries. ``loads`` is a flat array of
    rows of four numbers, one for each unknown; other rows are zero.
    """
    for i in beside:
        for axis in range(3):
            total = 0.0
            for k in range(indptr[i], indptr[i + 1]):
                total += data[k] * targets[indices[k], axis]
            loads[WIDTH * i + axis] = total


def _sweep(
    count, first, row_start, value_start, rows, values, size, vertices, loads, x, rhs, y
):  # fmt: skip
    """Compute `sweep` for ``size`` unknowns in ``count`` panels of L; the others are addresses."""
    first, vertices = integers(first, count + 1), integers(vertices, size)
    row_start, value_start = indices(row_start, count + 1), indices(value_start, count + 1)
    rows, values = integers(rows, row_start[count]), doubles(values, value_start[count])
    loads, x = doubles(loads, WIDTH * size), doubles(x, WIDTH * size)
    rhs, y = doubles(rhs, 0), doubles(y, 0)
    for i in range(size):
        given = load_row(rhs, WIDTH * at(vertices, i))
        store(x, WIDTH * i, subtract(given, load_row(loads, WIDTH * i)))
    for p in range(count):
        a, width = WIDTH * at(first, p), at(first, p + 1) - at(first, p)
        start, stop, v = at(row_start, p), at(row_start, p + 1), at(value_start, p)
        _forward(width, x, a, rows, start, stop, values, v)
    for p in range(count - 1, -1, -1):
        a, width = WIDTH * at(first, p), at(first, p + 1) - at(first, p)
        start, stop, v = at(row_start, p), at(row_start, p + 1), at(value_start, p)
        _backward(width, x, a, rows, start, stop, values, v)
    for i in range(size):
        store(y, WIDTH * at(vertices, i), load_row(x, WIDTH * i))


# Compiled loops call `_sweep` by its address: otherwise each of them would compile it again.
SWEEP = Callback(_sweep, types.void(*(types.intp,) * 12))
_call = caller(types.void)


@compiled(nogil=True)
def sweep(panels, vertices, loads, x, rhs, y):
    """Overwrite the rows ``vertices`` of ``y`` by A^-1 (rhs - loads).

    panels : the factored matrix A, from `pdrom.model.dynamics.solvers.panels`
    vertices : (n,) row of ``rhs`` and ``y`` of each unknown, in the order of the factor
    loads : (4 n,) rows that are subtracted from the right-hand side, in the order of the factor
    x : (4 n,) working array
    rhs, y : flat arrays of rows of four numbers
    """
    first, row_start, value_start, rows, values, address = panels
    if len(vertices) == 0:
        return
    arguments = (
        len(first) - 1, first.ctypes.data, row_start.ctypes.data, value_start.ctypes.data,
        rows.ctypes.data, values.ctypes.data, len(vertices), vertices.ctypes.data,
        loads.ctypes.data, x.ctypes.data, rhs.ctypes.data, y.ctypes.data,
    )  # fmt: skip
    _call(address, arguments)
