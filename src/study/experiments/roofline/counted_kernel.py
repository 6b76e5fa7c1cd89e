"""Operations of a local kernel at some positions."""

from dataclasses import replace
from functools import cache

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import Callback
from pdrom.model.constraints.local_kernel import LocalKernel, LocalPass
from study.experiments.roofline.counters import Counted, Operations


@cache
def counting(function: Callback) -> Counted:
    """Kernel that counts, made of the local kernel ``function``."""
    return Counted(function)


def operations(kernel: LocalKernel, y: np.ndarray) -> Operations:
    """Operations that a pass of ``kernel`` over all units executes at positions ``y`` (N, 3) m."""
    counted = counting(kernel.function)
    counted.reset()
    places = rows.flat(y)
    LocalPass([replace(kernel, function=counted)]).add(places, np.zeros_like(places), 1)
    return counted.operations
