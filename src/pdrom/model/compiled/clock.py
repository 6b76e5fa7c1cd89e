"""The monotonic clock in compiled code."""

import time

import numpy as np
from numba import types

from pdrom.model.compiled.functions import compiled

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
