"""Units of time that anyone can measure: seconds of processor time of three loops on one thread.

``./reproduce run python -m study.experiments.roofline.units`` measures them in a few seconds: 1e9
steps x <- a x + b that wait for each other (scalar), 1e9 sums and products in independent vectors
of four doubles (vector), 1e9 bytes read from an array of 256 MiB (memory). Each is the least of
some repeats in turns, scaled from a smaller number of steps.
"""

import sys
from collections.abc import Callable
from time import thread_time

import numpy as np

from pdrom.core.machine import Units
from pdrom.model.compiled.rows import WIDTH
from study.experiments.roofline.throughput import AT_ONCE, chain, products, read

SCALAR_STEPS, VECTOR_TIMES, MEMORY_BYTES = 10**7, 10**6, 2**28
REPEATS = 15


def units(repeats: int = REPEATS, memory_bytes: int = MEMORY_BYTES) -> Units:
    """Measure this machine.

    Parameters
    ----------
    repeats : measurements, of which the fastest counts
    memory_bytes : size of the array that is read, larger than every cache
    """
    numbers = np.ones(memory_bytes // 8)
    # amount of one call in units of 1e9, and the call
    trials: list[tuple[float, Callable[[int], object]]] = [
        (1e-9 * SCALAR_STEPS, lambda share: chain(SCALAR_STEPS // share)),
        (
            2e-9 * AT_ONCE * WIDTH * VECTOR_TIMES,
            lambda share: products(numbers, VECTOR_TIMES // share),
        ),
        (1e-9 * numbers.nbytes, lambda _: read(numbers, 1)),
    ]
    for _, run in trials:
        run(1000)  # compiles
    found = [[_seconds(run) / amount for amount, run in trials] for _ in range(repeats)]
    scalar, vector, memory = np.min(found, axis=0).tolist()
    return Units(unit_scalar_s=scalar, unit_vector_s=vector, unit_memory_s=memory)


def _seconds(run: Callable[[int], object]) -> float:
    before = thread_time()
    run(1)
    return thread_time() - before


if __name__ == "__main__":
    measured = units()
    for name, seconds in [*measured.model_dump().items(), ("unit_s", measured.unit_s)]:
        sys.stdout.write(f"{name} {seconds:.4f}\n")
