"""Rates of this machine, one thread: bytes read by working set; operations on doubles.

Vectors have four doubles, as everywhere in the compiled code of the study.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from pdrom.model.compiled.rows import WIDTH
from study.experiments.roofline.bound import DIVISIONS, FLOPS, READ, ROOTS
from study.experiments.roofline.throughput import AT_ONCE, divisions, products, read, roots

COLUMNS = ["quantity", "working_set", "level", "rate", "low", "high"]
SMALLEST_SET = 16 * 1024
MEMORY = "memory"

_CACHES = Path("/sys/devices/system/cpu/cpu0/cache")


# operations a lane and step, and what does the steps
_ARITHMETIC = {
    FLOPS: (2, products),
    DIVISIONS: (1, divisions),
    ROOTS: (1, roots),
}


@dataclass(frozen=True)
class _Trial:
    """``run`` does ``amount`` of what ``labels`` name in one time."""

    labels: dict[str, Any]
    run: Callable[[np.ndarray, int], float]
    numbers: np.ndarray
    amount: int

    def seconds(self, times: int) -> float:
        before = perf_counter()
        self.run(self.numbers, times)
        return perf_counter() - before

    def times(self, least: float) -> int:
        """Number of times that it has to run to take ``least`` seconds."""
        self.run(self.numbers, 1)  # compiles
        times = 1
        while self.seconds(times) < least:
            times *= 2
        return times


def rates(largest: int, seconds: float, repeats: int) -> list[dict[str, Any]]:
    """Rows of `COLUMNS`, rates in 1e9 a second: median and quartiles of interleaved repeats.

    Parameters
    ----------
    largest : of the working sets, bytes; the others are halves of it down to `SMALLEST_SET`
    seconds : that a repeat takes at least
    """
    trials = list(_trials(np.ones(largest // 8)))
    times = [trial.times(seconds) for trial in trials]
    found = [
        [1e-9 * trial.amount * n / trial.seconds(n) for trial, n in zip(trials, times, strict=True)]
        for _ in range(repeats)
    ]
    quartiles = np.percentile(found, [50, 25, 75], axis=0).T.tolist()
    named = (dict(zip(("rate", "low", "high"), values, strict=True)) for values in quartiles)
    return [trial.labels | rate for trial, rate in zip(trials, named, strict=True)]


def _trials(numbers: np.ndarray) -> Iterator[_Trial]:
    step, size = AT_ONCE * WIDTH, numbers.nbytes
    while size >= SMALLEST_SET:
        part = numbers[: size // (8 * step) * step]
        labels = {"quantity": READ, "working_set": part.nbytes, "level": level(part.nbytes)}
        yield _Trial(labels, read, part, part.nbytes)
        size //= 2
    for quantity, (count, run) in _ARITHMETIC.items():
        yield _Trial({"quantity": quantity}, run, numbers, count * step)


def caches(folder: Path = _CACHES) -> list[tuple[str, int]]:
    """Names and bytes of the caches of data that the system lists in ``folder``, smallest first."""
    found = []
    for index in sorted(folder.glob("index*")):
        kind, size, number = (
            (index / name).read_text().strip() for name in ("type", "size", "level")
        )
        if kind != "Instruction" and size.endswith("K"):
            found.append((f"L{number}", 1024 * int(size[:-1])))
    return sorted(found, key=lambda cache: cache[1])


def level(size: int) -> str | None:
    """The smallest cache that holds ``size`` bytes; None where the system reports no cache."""
    known = caches()
    return next((name for name, held in known if size <= held), MEMORY if known else None)
