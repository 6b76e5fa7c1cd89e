"""Compilation of functions with Numba, their cache on disk, and a clock for compiled code."""

import gc
import os
import time
from contextlib import ExitStack, suppress
from fcntl import LOCK_EX, flock
from functools import cache, cached_property
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

_INTEGER = ir.IntType(types.intp.bitwidth)
MODEL = Path(__file__).parents[1]
_LOADER: Any = __spec__.loader
# Folders with functions that compiled functions of any folder inline.
KERNELS = {MODEL / name for name in ("compiled", "constraints", "dynamics")}


@cache
def _checksum(folder: Path) -> str:
    """Return a checksum of the source files in ``folder`` and `KERNELS`, as they are imported."""
    sources = sorted(path for each in {*KERNELS, folder} for path in each.glob("*.py"))
    return f"{crc32(b''.join(_LOADER.get_data(str(path)) for path in sources)):08x}"


def _mark(function):
    """Append to the name of ``function`` a checksum of all files whose code it may inline.

    Numba's cache checks only size and date of the function's own file. Without the checksum in the
    name, it would return outdated machine code after an edit of a file whose functions are inlined,
    or code of another text of the file, if the file was edited after its import.
    """
    function.__qualname__ += f"_{_checksum(Path(function.__code__.co_filename).parent)}"


class _Cache(FunctionCache):  # type: ignore[misc]
    """Cache on disk; if several processes need a function, one compiles it and the others wait."""

    def load_overload(self, signature, context):
        if (found := super().load_overload(signature, context)) is not None:
            return found
        self._held = ExitStack()
        with suppress(OSError):  # some file systems have no locks
            os.makedirs(self.cache_path, exist_ok=True)
            lock = Path(self.cache_path, f"{self._impl.filename_base}.lock")
            flock(self._held.enter_context(lock.open("w")), LOCK_EX)
        if (found := super().load_overload(signature, context)) is not None:
            self._held.close()
        elif gc.isenabled():  # garbage collection would take 10 % of the time
            gc.disable()
            self._held.callback(gc.enable)
        return found

    def save_overload(self, signature, result):
        super().save_overload(signature, result)
        self._held.close()


def compiled(function=None, **options):
    """Compile ``function``, cached on disk, with neither checks for division by zero nor fast-math.

    ``options`` are passed to Numba's ``njit``, where they may enable either; without a function, a
    decorator is returned. There is no wrapper for callers in C.
    """
    if function is None:
        return lambda wrapped: compiled(wrapped, **options)
    _mark(function)
    made = njit(**{"error_model": "numpy", "no_cfunc_wrapper": True} | options)(function)
    made._cache = _Cache(function)
    return made


class _InnerCode(JITCodeLibrary):  # type: ignore[misc]
    """Code of an inner function: only its callers optimise it and turn it into machine code."""

    def _finalize_final_module(self):
        self._finalized = True

    def _nothing(self, *_arguments):
        return 0

    _optimize_final_module = get_pointer_to_function = set_env = _nothing
    codegen = property(lambda self: self)


class _InnerCompiler(Compiler):  # type: ignore[misc]
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.state.library = _InnerCode(self.state.targetctx.codegen(), "inner")


def inner(function=None, **options):
    """Compile ``function``, which only compiled functions call, without caching it on disk.

    Its arguments may be functions, which Numba identifies by numbers that change with the process.
    """
    if function is None:
        return lambda wrapped: inner(wrapped, **options)
    own = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
    made = njit(pipeline_class=_InnerCompiler, **own, **options)(function)
    own_of = made.get_call_template  # Numba would compile for each constant integer
    made.get_call_template = lambda args, kws: own_of([types.unliteral(a) for a in args], kws)
    return made


class Callback:
    """Function that compiled code calls by its `address`; first access to `address` compiles it.

    function, signature : Python function to compile and its Numba signature
    """

    def __init__(self, function, signature):
        _mark(function)
        self.function, self.signature, self._compiled = function, signature, []

    @cached_property
    def address(self):
        """Address of the compiled function, valid as long as this object exists."""
        own = {"nopython": True, "error_model": "numpy"}
        made: Any = CFunc(self.function, normalize_signature(self.signature), {}, own)
        made._cache = _Cache(self.function)
        made.compile()
        self._compiled.append(made)  # two threads may compile at once: keep both results
        return made.address


def caller(result):
    """Return f(address, integers) for compiled code: it calls a `Callback` returning ``result``."""

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
    """Return the buffer of two integers into which `now` reads the time."""
    return np.zeros(2, np.int64)


@compiled(nogil=True)
def now(clock):
    """Return the monotonic time in seconds; ``clock`` is a buffer from `clock`."""
    _clock_gettime(_CLOCK, clock.ctypes)
    return clock[0] + 1e-9 * clock[1]
