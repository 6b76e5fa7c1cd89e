"""Local steps as compiled functions that the compiled step loop calls by address.

A local kernel reads its data from a record (an array of addresses and numbers), so that one loop
can call any combination of constraint groups and reduced local steps.
"""

import ctypes
from collections.abc import Callable, Sequence

import numpy as np
from numba import types

from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import Callback, caller, compiled, inner

# Indices into every kernel's record: number of vertices, first entry that is specific to a kernel.
VERTICES, OWN = 0, 1

Table = tuple[np.ndarray, np.ndarray]
"""Addresses of kernels and addresses of their records."""

_SIGNATURE = types.float64(types.intp, types.intp, types.intp)


def local_kernel(function):
    """Compile ``function(y, rhs, record) -> energy``; all three arguments are addresses.

    y, rhs : (N, 4), a column of zeros last; S^T W p(y) is added to rhs
    record : int64 array with the data of the kernel, see `VERTICES`, `OWN`
    """
    return Callback(function, _SIGNATURE)


_call_local, _call_gradients = caller(types.float64), caller(types.void)


@inner(forceinline=True)
def call(address, y, rhs, record):
    """Call the local kernel at ``address`` with the arguments that `local_kernel` describes."""
    return _call_local(address, (y, rhs, record))


@compiled(nogil=True)
def add_all(table, y, rhs):
    """Add S^T W p(y) of all kernels of ``table`` (a `Table`) to ``rhs``; return their energy, J.

    ``y`` and ``rhs`` (4 N,) have x, y, z and 0 of each vertex.
    """
    addresses, records = table
    energy = 0.0
    for k in range(len(addresses)):
        energy += call(addresses[k], y.ctypes.data, rhs.ctypes.data, records[k])
    return energy


@compiled(nogil=True)
def _call(address, y, out, record):
    return call(address, y, out, record)


class LocalKernel:
    """A compiled local step with its data.

    function : result of `local_kernel`; it is compiled when its address is first needed
    vertices : number of vertices
    record : int64 array that is passed to the function; from `OWN` on it has the ``numbers`` and
        the addresses of the ``arrays``, which the object keeps alive
    """

    def __init__(
        self,
        function: Callback,
        vertices: int,
        arrays: Sequence[np.ndarray],
        numbers: Sequence[int],
    ) -> None:
        self.function, self.arrays = function, tuple(arrays)
        places = [array.ctypes.data for array in arrays]
        self.record = np.array([vertices, *numbers, *places], dtype=np.int64)

    @property
    def address(self) -> int:
        """Address of the compiled function."""
        return self.function.address

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add S^T W p(y) at ``y`` (N, 3) to ``rhs`` (N, 3), and return the energy, J."""
        right = rows.flat(rhs)
        if rows.shares(rhs, right):
            return self._write(y, right)
        added = rows.zeros(len(right))
        energy = self._write(y, added)
        rhs += rows.unflat(added)
        return energy

    def projections(self, y: np.ndarray, count: int) -> np.ndarray:
        """Return projections (count, 3) that this kernel, a sampler, writes at y (N, 3)."""
        p = np.empty((count, 3))
        self._write(y, p)
        return p

    def _write(self, y: np.ndarray, out: np.ndarray) -> float:
        numbers = rows.flat(y)
        return _call(self.address, numbers.ctypes.data, out.ctypes.data, self.record.ctypes.data)


class PythonKernel:
    """Local step without compiled code, which compiled loops call by address as a `LocalKernel`.

    ``accumulate`` maps y and rhs (``vertices``, 3) to the energy, J, and changes rhs.
    """

    def __init__(self, accumulate: Callable[..., float], vertices: int) -> None:
        def call(y: int, rhs: int, _: int) -> float:
            numbers = ctypes.c_double * (rows.WIDTH * vertices)
            found = (np.ctypeslib.as_array(numbers.from_address(place)) for place in (y, rhs))
            return accumulate(*(each.reshape(vertices, -1)[:, :3] for each in found))

        self._call = ctypes.CFUNCTYPE(ctypes.c_double, *3 * [ctypes.c_ssize_t])(call)
        self.address = ctypes.cast(self._call, ctypes.c_void_p).value
        self.record = np.array([vertices], dtype=np.int64)


def table_of(kernels: Sequence[LocalKernel | PythonKernel]) -> Table:
    """Return the addresses of ``kernels``, which are valid as long as these objects exist."""
    addresses = np.array([kernel.address for kernel in kernels], dtype=np.int64)
    records = np.array([kernel.record.ctypes.data for kernel in kernels], dtype=np.int64)
    return addresses, records


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
