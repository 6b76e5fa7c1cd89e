"""Timings in one process, after a warm-up, with the compared variants in turn.

A variant has a step loop and its initial state. Every repeat runs each variant once from there, so
that changes of the processor's clock rate affect all variants alike. For each frame, the time of
the median repeat is used: an interruption by other programs affects one frame of one repeat.

The addresses of arrays and code in a process change its times by more than its repeats scatter.
Only new processes show that (`in_processes`); a fork would inherit the addresses.
"""

import logging
import pickle
import subprocess
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import Field

from pdrom.core.errors import PdromError
from pdrom.core.store.checksum import damaged_set_aside
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.stepper import State, Stepper
from study.experiments.kit.base import Count, Repeats

T = TypeVar("T")
log = logging.getLogger(__name__)

# Times of a frame, in this order: total; prediction, contacts and velocities; projections of all
# groups, and coefficients of reduced groups; product with S^T W, if it is separate from the
# projections; right-hand side from coefficients; global step; positions of all vertices, if the
# loop has other coordinates.
PHASES = (
    "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms", "global_ms", "vertices_ms",
)  # fmt: skip
_INNER = ("assembly_seconds", "lift_seconds")


class Protocol(ConfigModel):
    """Settings: ``repeats`` timed runs of ``frames`` frames each, after ``warmup`` untimed runs."""

    frames: Count = 10
    warmup: Annotated[int, Field(ge=0, le=1000)] = 1
    repeats: Repeats = 5


class Processes(Protocol):
    """Settings: ``processes`` time every run, each with ``frames``, ``warmup`` and ``repeats``."""

    frames: Count = 4
    repeats: Repeats = 3
    processes: Repeats = 10


@dataclass(frozen=True)
class Variant:
    """A loop to time: first columns of its row, the loop with its first state, number of frames.

    ``share`` is the fraction of a frame's iterations that the loop does; the times of phases inside
    the iterations are divided by it. ``output`` computes the positions of all vertices from the
    coordinates of a loop in a subspace, after every ``steps`` of its steps. ``starts`` are pairs
    (state, number of the next step); if given, ``steps`` steps are timed from each of them in turn,
    in place of the first ``frames``.
    """

    labels: dict[str, Any]
    loop: Stepper
    start: State
    frames: int
    share: float = 1.0
    output: Callable[[np.ndarray], np.ndarray] | None = None
    steps: int = 1
    starts: tuple[tuple[State, int], ...] = ()


def measure(variants: Sequence[Variant], warmup: int, repeats: int) -> list[dict[str, Any]]:
    """Time all variants; the first of ``warmup`` runs also factorises and caches matrices.

    Returns a row per variant: its labels, and times by phase (`PHASES`) in ms, as means over the
    frames, each frame from its median repeat.

    Parameters
    ----------
    warmup, repeats : numbers of unmeasured and of measured runs of each variant
    """
    samples: list[list[np.ndarray]] = [[] for _ in variants]
    for repeat in range(-warmup, repeats):
        for own, variant in zip(samples, variants, strict=True):
            own.append(_time_once(variant))
        log.info("repeat %d of %d", max(0, repeat + 1), repeats)
    times = [median_frames(np.array(own[warmup:])).tolist() for own in samples]
    return [
        {**variant.labels, **dict(zip(PHASES, own, strict=True))}
        for variant, own in zip(variants, times, strict=True)
    ]


def measure_calls(
    calls: Mapping[Hashable, Callable[[], object]], warmup: int, repeats: int
) -> dict[Hashable, float]:
    """Median time of each of ``calls``, ms; calls alternate, the first ``warmup`` are untimed."""
    samples: dict[Hashable, list[float]] = {key: [] for key in calls}
    for _ in range(warmup + repeats):
        for key, call in calls.items():
            before = perf_counter()
            call()
            samples[key].append(1e3 * (perf_counter() - before))
    return {key: float(np.median(values[warmup:])) for key, values in samples.items()}


def clocked(made: Iterable[T]) -> Iterator[tuple[float, T]]:
    """Yield (processor time in s to make it, item) for every item of ``made``."""
    items = iter(made)
    while True:
        before = process_time()
        try:
            item = next(items)
        except StopIteration:
            return
        yield process_time() - before, item


def _time_once(variant: Variant) -> np.ndarray:
    """Milliseconds by phase (`PHASES`) of each frame, up to the first that is not finite."""
    loop, state, rows = variant.loop, variant.start, []
    frame = -1
    with np.errstate(over="ignore", invalid="ignore"):
        for number in range(variant.frames):
            frame += 1
            if variant.starts and number % variant.steps == 0:
                state, frame = variant.starts[number // variant.steps]
            for step in loop.local_steps:
                for name in _INNER:
                    if hasattr(step, name):
                        setattr(step, name, 0.0)
            state, report = loop.step(state, frame)
            inner = [sum(getattr(s, name, 0.0) for s in loop.local_steps) for name in _INNER]
            vertices, before = 0.0, perf_counter()
            if variant.output is not None and (number + 1) % variant.steps == 0:
                variant.output(state.positions)
                vertices = perf_counter() - before
            rows.append([*report.seconds, *inner, vertices])
            if not np.isfinite(state.positions).all():
                break
    start, local, solve, end, assembly, lift, vertices = np.array(rows).T
    repeated = np.array([local - assembly - lift, assembly, lift, solve]) / variant.share
    inertia = start + end
    total = inertia + repeated.sum(axis=0) + vertices
    return 1e3 * np.vstack([total, inertia, repeated, vertices]).T


def median_frames(samples: np.ndarray) -> np.ndarray:
    """Mean over frames of ``samples`` (repeats, frames, phases), each from its median repeat.

    The median repeat of a frame is the one with the median total, the first phase. All phases are
    from this repeat, since medians of single phases would not add up to the total.
    """
    order = np.argsort(samples[:, :, 0], axis=0, kind="stable")[len(samples) // 2]
    return samples[order, np.arange(samples.shape[1])].mean(axis=0)


def in_processes(
    cases: Sequence[Callable[[], Iterable[Variant]]], asked: Processes
) -> list[dict[str, Any]]:
    """Rows of all variants (labels and times) for each of several new processes, in order.

    One process after the other times all variants, in a random order of its own. Each of ``cases``
    is pickled and called in the process, where it makes its variants.

    Raises
    ------
    PdromError
        A process failed; the message ends with the last line of its output.
    """
    rows: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        given, answer = Path(folder, "cases.pickle"), Path(folder, "rows.pickle")
        given.write_bytes(pickle.dumps((cases, asked)))
        for process in range(1, asked.processes + 1):
            ended = subprocess.run(
                [sys.executable, "-m", __name__, str(given), str(answer), str(process)],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
            )  # fmt: skip
            if ended.returncode:
                last = ended.stderr.strip().rpartition("\n")[2]
                raise PdromError(
                    f"a process that times frames ended with {ended.returncode}: {last}"
                )
            rows += pickle.loads(answer.read_bytes())
            log.info("process %d of %d", process, asked.processes)
    return rows


def _in_this_process(given: str, answer: str, process: str) -> None:
    """Time the pickled cases in the file ``given`` and write the rows to the file ``answer``."""
    with damaged_set_aside():  # rename damaged files, as the job does that started this process
        cases, asked = pickle.loads(Path(given).read_bytes())
        variants = [variant for case in cases for variant in case()]
        order = np.random.default_rng(int(process)).permutation(len(variants))
        measured = measure([variants[i] for i in order], asked.warmup, asked.repeats)
    rows = [{**measured[i], "process": int(process)} for i in np.argsort(order)]
    Path(answer).write_bytes(pickle.dumps(rows))


if __name__ == "__main__":
    _in_this_process(*sys.argv[1:])
