"""Record the speed of the machine in three units of time, and the versions of libraries.

The units are the processor times, on one thread, of 1e9 dependent steps x <- a x + b (scalar), of
1e9 sums and products in independent vectors of four doubles (vector), and of reading 1e9 bytes of
an array of 256 MiB (memory). Each is extrapolated from the fastest of several shorter loops.
``./reproduce run python -m study.experiments.machine`` measures and prints them in a few seconds.
"""

import sys
from collections.abc import Callable
from time import thread_time

import numpy as np

from pdrom.core import machine as this
from pdrom.core.store import write_text
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.compiled.arithmetic import add, add_product, constant, total
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, load
from study.artifact.paths import MACHINE, File
from study.experiments.kit.base import experiment

AT_ONCE = 8  # number of independent vectors, enough to hide the latency of sums and products
SCALAR_STEPS, VECTOR_TIMES = 10**7, 10**6
MEMORY_BYTES = 2**28  # size of the array that is read, larger than any cache
REPEATS = 15


class Units(ConfigModel):
    """Times, s, of three benchmark loops: scalar, vector, memory."""

    unit_scalar_s: float
    unit_vector_s: float
    unit_memory_s: float

    @property
    def unit_s(self) -> float:
        """Geometric mean of the benchmark times, s; expected run times are proportional to it."""
        return (self.unit_scalar_s * self.unit_vector_s * self.unit_memory_s) ** (1 / 3)


class Record(this.Machine):
    """Machine and code that produced the results, with the times of the benchmark loops."""

    units: Units


@experiment(
    "Record of the machine and the library versions", reads={}, writes={"out": MACHINE}, alone=True
)
def machine(out: File) -> None:
    """Write times of the benchmark loops and data about machine and libraries to ``out``."""
    record = Record(**this.machine().model_dump(), units=units())
    write_text(record.model_dump_json(indent=2) + "\n", out.path)


def units() -> Units:
    """Time the three benchmark loops (`Units`) on this machine; each time is a minimum."""
    numbers = np.ones(MEMORY_BYTES // 8)
    # (billions of operations or bytes, function that does 1/``share`` of them; `_read` reads all)
    trials: list[tuple[float, Callable[[int], object]]] = [
        (1e-9 * SCALAR_STEPS, lambda share: _chain(SCALAR_STEPS // share)),
        (
            2e-9 * AT_ONCE * WIDTH * VECTOR_TIMES,
            lambda share: _products(numbers, VECTOR_TIMES // share),
        ),
        (1e-9 * numbers.nbytes, lambda _: _read(numbers)),
    ]
    for _, run in trials:
        run(1000)  # the first call compiles the kernel
    found = [[_seconds(run) / amount for amount, run in trials] for _ in range(REPEATS)]
    scalar, vector, memory = np.min(found, axis=0).tolist()
    return Units(unit_scalar_s=scalar, unit_vector_s=vector, unit_memory_s=memory)


def _seconds(run: Callable[[int], object]) -> float:
    before = thread_time()
    run(1)
    return thread_time() - before


@compiled(nogil=True)
def _chain(times):
    """Compute x <- x / 2 + 1 ``times`` times, each step from the last result; return the result."""
    x = 0.0
    for _ in range(times):
        x = 0.5 * x + 1.0
    return x


@compiled(nogil=True)
def _products(numbers, times):
    """Compute x <- a + x a ``times`` times for `AT_ONCE` vectors x; ``numbers`` are a, then x."""
    one = load(numbers, 0)
    a, b = load(numbers, WIDTH), load(numbers, 2 * WIDTH)
    c, d = load(numbers, 3 * WIDTH), load(numbers, 4 * WIDTH)
    e, f = load(numbers, 5 * WIDTH), load(numbers, 6 * WIDTH)
    g, h = load(numbers, 7 * WIDTH), load(numbers, 8 * WIDTH)
    for _ in range(times):
        a, b = add_product(one, a, one), add_product(one, b, one)
        c, d = add_product(one, c, one), add_product(one, d, one)
        e, f = add_product(one, e, one), add_product(one, f, one)
        g, h = add_product(one, g, one), add_product(one, h, one)
    return total(add(add(add(a, b), add(c, d)), add(add(e, f), add(g, h))))


@compiled(nogil=True)
def _read(numbers):
    """Return the sum of the ``numbers``, whose count is a multiple of 32."""
    a, b, c, d = constant(0.0), constant(0.0), constant(0.0), constant(0.0)
    e, f, g, h = constant(0.0), constant(0.0), constant(0.0), constant(0.0)
    for i in range(0, len(numbers), AT_ONCE * WIDTH):
        a, b = add(a, load(numbers, i)), add(b, load(numbers, i + WIDTH))
        c, d = add(c, load(numbers, i + 2 * WIDTH)), add(d, load(numbers, i + 3 * WIDTH))
        e, f = add(e, load(numbers, i + 4 * WIDTH)), add(f, load(numbers, i + 5 * WIDTH))
        g, h = add(g, load(numbers, i + 6 * WIDTH)), add(h, load(numbers, i + 7 * WIDTH))
    return total(add(add(add(a, b), add(c, d)), add(add(e, f), add(g, h))))


if __name__ == "__main__":
    measured = units()
    for name, seconds in [*measured.model_dump().items(), ("unit_s", measured.unit_s)]:
        sys.stdout.write(f"{name} {seconds:.4f}\n")
