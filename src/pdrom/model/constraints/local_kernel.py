"""Local steps as compiled functions that the compiled step loop calls by address.

A local kernel reads its data from a record (an array of addresses and numbers), so that one loop
can call any combination of constraint groups and reduced local steps. The units of work (blocks of
elements or rows) of a large local step are divided into two parts, which were made for two threads
(docs/decisions/0018-what-was-given-up.md) and now run one after the other. The first part adds to
the right-hand side, the second to a separate array that is added afterwards.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numba import types

from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import Callback, caller, compiled, inner

# Indices into every kernel's record. VERTICES: number of vertices; FIRST + k: first unit of work of
# part k, which ends before the unit at FIRST + k + 1; OWN: first entry specific to a kernel.
VERTICES, FIRST, OWN = 0, 1, 4
# Values of a kernel's argument `part`: do part 0 or 1 of its work, or prepare data for both parts.
PARTS, PREPARE = (0, 1), 2

Table = tuple[np.ndarray, np.ndarray, int]
"""Addresses of kernels, addresses of their records, and the argument ``part`` of all calls."""

_SIGNATURE = types.float64(types.intp, types.intp, types.intp, types.intp)


def local_kernel(function):
    """Compile ``function(y, rhs, record, part) -> energy``; y, rhs and record are addresses.

    y, rhs : (N, 4), a column of zeros last; S^T W p(y) of the part's units of work is added to rhs
    record : int64 array with the data of the kernel, see `VERTICES`, `FIRST`, `OWN`
    part : one of the two `PARTS` of the work, or `PREPARE`: only prepare data for both
    """
    return Callback(function, _SIGNATURE)


_call_local, _call_gradients = caller(types.float64), caller(types.void)


@inner(forceinline=True)
def call(address, y, rhs, record, part):
    """Call the local kernel at ``address`` with the arguments that `local_kernel` describes."""
    return _call_local(address, (y, rhs, record, part))


@compiled(nogil=True)
def add_part(table, y, rhs):
    """Call every kernel of ``table`` (a `Table`) with the argument ``part`` that the table has.

    ``y`` and ``rhs`` (added to): addresses of arrays (N, 4), last column zero. Returns energy, J.
    """
    addresses, records, part = table
    energy = 0.0
    for k in range(len(addresses)):
        energy += call(addresses[k], y, rhs, records[k], part)
    return energy


class LocalKernel:
    """A compiled local step with its data.

    Parameters
    ----------
    function : result of `local_kernel`; it is compiled when its address is first needed
    vertices, units : number of vertices; number of units of work (blocks of elements or rows)
    arrays, numbers : the record contains, from `OWN` on, the numbers and the arrays' addresses
    touched : function that maps the index of a unit to the vertices to which it and all later units
        add; with it, units are divided into two parts (see the module), without it there is one
    prepares : whether the kernel must be called with `PREPARE` before its parts

    Attributes
    ----------
    record : int64 array that is passed to the function; the object keeps the ``arrays`` alive
    touched : range of vertices to which the second part adds; empty without a second part
    """

    def __init__(
        self,
        function: Callback,
        vertices: int,
        units: int,
        arrays: Sequence[np.ndarray],
        numbers: Sequence[int],
        touched: Callable[[int], np.ndarray] | None = None,
        prepares: bool = False,
    ) -> None:
        self.function, self.arrays, self.prepares = function, tuple(arrays), prepares
        self.touched, middle = range(0), units
        if touched is not None and units > 1:
            middle = units // 2
            later = touched(middle)
            self.touched = range(int(later.min()), int(later.max()) + 1)
        places = [array.ctypes.data for array in arrays]
        self.record = np.array([vertices, 0, middle, units, *numbers, *places], dtype=np.int64)

    @property
    def address(self) -> int:
        """Address of the compiled function."""
        return self.function.address


@compiled(nogil=True)
def _call(address, y, out, record):
    return call(address, y, out, record, PARTS[0])


def projections(sampler: LocalKernel, y: np.ndarray, count: int) -> np.ndarray:
    """Return projections (count, 3) that the kernel ``sampler`` writes at positions y (N, 3)."""
    p, places = np.empty((count, 3)), rows.flat(y)
    _call(sampler.address, places.ctypes.data, p.ctypes.data, sampler.record.ctypes.data)
    return p


class LocalPass:
    """Calls all local kernels of a step loop, one after the other.

    Attributes
    ----------
    first, second : `Table`s of all kernels, and of those whose work has a second part
    preparing : `Table` of the kernels that prepare data for both parts before the first one
    """

    def __init__(self, kernels: Sequence[LocalKernel]) -> None:
        self.kernels = tuple(kernels)
        self.first = _table(kernels, PARTS[0])
        self.preparing = _table([kernel for kernel in kernels if kernel.prepares], PREPARE)
        self.second = _table([kernel for kernel in kernels if kernel.touched], PARTS[1])
        touched = [kernel.touched for kernel in kernels if kernel.touched]
        self.touched = range(0)
        self.other = rows.zeros(0)
        if touched:
            self.touched = range(min(r.start for r in touched), max(r.stop for r in touched))
            vertices = max(int(kernel.record[VERTICES]) for kernel in kernels)
            self.other = rows.zeros(rows.WIDTH * vertices)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) at ``y`` (N, 3) to ``rhs`` (N, 3), and return the energy, J."""
        right = rows.flat(rhs)
        if rows.shares(rhs, right):
            return self._add(rows.flat(y), right)
        added = rows.zeros(len(right))
        energy = self._add(rows.flat(y), added)
        rhs += rows.unflat(added)
        return energy

    def _add(self, y: np.ndarray, rhs: np.ndarray) -> float:
        places = y.ctypes.data, rhs.ctypes.data
        add_part(self.preparing, *places)
        energy = add_part(self.first, *places)
        if self.touched:
            own = slice(rows.WIDTH * self.touched.start, rows.WIDTH * self.touched.stop)
            self.other[own] = 0.0
            energy += add_part(self.second, y.ctypes.data, self.other.ctypes.data)
            rhs[own] += self.other[own]
        return energy


def _table(kernels: Sequence[LocalKernel], part: int) -> Table:
    addresses = np.array([kernel.address for kernel in kernels], dtype=np.int64)
    records = np.array([kernel.record.ctypes.data for kernel in kernels], dtype=np.int64)
    return addresses, records, part


_GRADIENTS = types.void(*4 * [types.intp])


def gradient_kernel(function):
    """Compile ``function(d, parameters, p, m)``, which computes projections of m elements from S q.

    In a position subspace S q is computed by a small dense product, not from vertices. The compiled
    loop of a subspace calls the result by its attribute ``address``, so that one loop can call any
    combination of groups.

    d : address of (m, rows, 3) values of S q
    parameters : address of the numbers of `ConstraintGroup.kernel_parameters`
    p : address of (m, rows, 3) numbers, to which the projections are written
    """
    return Callback(function, _GRADIENTS)


@inner(forceinline=True)
def call_gradients(address, d, parameters, p, m):
    """Call the result of `gradient_kernel` at ``address`` for ``m`` elements; ``d``, ``parameters``
    and ``p`` are addresses of S q, of the parameters, and of the projections to be written."""
    _call_gradients(address, (d, parameters, p, m))
