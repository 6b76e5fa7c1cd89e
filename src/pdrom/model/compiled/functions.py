"""Compiling the compiled functions of the model, keeping them, and their clock."""

import time
from functools import cache, cached_property
from pathlib import Path
from zlib import crc32

import numpy as np
from llvmlite import ir
from numba import cfunc, njit, types
from numba.extending import intrinsic

_INTEGER = ir.IntType(types.intp.bitwidth)
KERNELS = ("compiled", "constraints", "dynamics")  # folders whose functions others inline


@cache
def _checksum(folders: tuple[str, ...]) -> str:
    """Checksum of the sources in some folders of the model."""
    model = Path(__file__).parents[1]
    sources = sorted(path for folder in folders for path in model.glob(f"{folder}/*.py"))
    return f"{crc32(b''.join(path.read_bytes() for path in sources)):08x}"


def _mark(function):
    """Put a checksum of all that it may inline into the name of a function.

    numba's cache looks at the file of a function only, not at those of what it inlines: without it
    a function would stay as it was when another file is edited.
    """
    own = function.__module__.removeprefix("pdrom.model.").split(".")[0]
    beside = own if (Path(__file__).parents[1] / own).is_dir() else KERNELS[0]
    function.__qualname__ += f"_{_checksum(tuple(sorted({*KERNELS, beside})))}"


def compiled(function=None, **options):
    """Compile and keep a ``function``: without division checks, without fast-math by default.

    ``options`` are those of Numba's ``njit``; without a function this is a decorator with them.
    No function is compiled a second time for callers in C, of which there are none.
    """
    if function is None:
        return lambda wrapped: compiled(wrapped, **options)
    _mark(function)
    return njit(cache=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)


def inner(function=None, **options):
    """Compile a ``function`` that only other compiled functions call: kept with each of these.

    Without an entry for callers in Python, which takes longer to compile than a short function.
    """
    if function is None:
        return lambda wrapped: inner(wrapped, **options)
    own = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return njit(error_model="numpy", **own, **options)(function)


def template(function):
    """Compile a function that takes functions, into each function that calls it.

    It is not kept: numba names a function among the arguments by a number of the process.
    """
    return njit(error_model="numpy", forceinline=True)(function)


class Callback:
    """A function that other compiled code calls by its address; compiled at the first question.

    Attributes
    ----------
    function, signature : what is compiled
    """

    def __init__(self, function, signature):
        _mark(function)
        self.function, self.signature = function, signature

    @cached_property
    def _compiled(self):
        return cfunc(self.signature, cache=True, error_model="numpy")(self.function)

    @property
    def address(self):
        """Address of the compiled function."""
        return self._compiled.address


def caller(result):
    """An intrinsic of an address and a tuple of integers: calls a `Callback` with ``result``."""

    def typed(_context, address, arguments):
        def generate(context, builder, _signature, values):
            kind = ir.FunctionType(context.get_value_type(result), [_INTEGER] * len(arguments))
            own = [builder.extract_value(values[1], k) for k in range(len(arguments))]
            returned = builder.call(builder.inttoptr(values[0], kind.as_pointer()), own)
            return context.get_dummy_value() if result == types.void else returned

        return result(address, arguments), generate

    return intrinsic(typed)


_CLOCK = time.CLOCK_MONOTONIC
_clock_gettime = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.voidptr))


def clock() -> np.ndarray:
    """Memory that `now` works with."""
    return np.zeros(2, np.int64)


@compiled(nogil=True)
def now(clock):
    """Seconds since some moment, by the ``clock``."""
    _clock_gettime(_CLOCK, clock.ctypes)
    return clock[0] + 1e-9 * clock[1]
