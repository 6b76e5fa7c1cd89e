"""Timings in one process, after a warm-up, with the compared variants in turn; medians count.

A variant makes a step loop and its initial state. Every repeat runs each variant once, from there,
so that drifts of the machine's clock hit all variants alike. Of each frame the repeat with the
median time counts: an interruption hits one frame of one repeat, and is left out.
"""

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field

from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.stepper import State, Stepper
from study.experiments.kit.settings import Count, Repeats

T = TypeVar("T")
Progress = Callable[[int, int], None]


class Protocol(ConfigModel):
    """``frames`` of each run, after ``warmup`` unmeasured runs, in ``repeats`` measured ones."""

    frames: Count = 10
    warmup: Annotated[int, Field(ge=0, le=1000)] = 1
    repeats: Repeats = 5


@dataclass(frozen=True)
class Variant:
    """A loop to time: labels for the table, the loop with its first state, and how many frames.

    ``share`` is the part of a frame's iterations that the loop does; the times of the phases that
    repeat with the iterations are divided by it.
    """

    labels: dict[str, object]
    loop: Stepper
    start: State
    frames: int
    share: float = 1.0


@dataclass(frozen=True)
class Measurement:
    """Mean times per frame in ms, by phase, of the median repeat of each frame.

    inertia : prediction at the beginning of a frame, contacts and velocities at its end
    local : projections of all groups, and coefficients of reduced ones
    assembly : product with S^T W, where an implementation does it apart from the projections
    lift : from coefficients to the right-hand side
    solve : global step
    low, high : least and largest mean time per frame of a repeat
    """

    labels: dict[str, object]
    frame: float
    inertia: float
    local: float
    assembly: float
    lift: float
    solve: float
    low: float
    high: float
    repeats: int


def measure(
    variants: Sequence[Variant],
    warmup: int,
    repeats: int,
    progress: Progress = lambda done, total: None,
) -> list[Measurement]:
    """Time all variants; factorisations are cached by the first run, the warm-up.

    Parameters
    ----------
    warmup, repeats : runs of each variant before the timed ones, and timed ones
    progress : called with the repeats that are done and all
    """
    samples: list[list[np.ndarray]] = [[] for _ in variants]
    for repeat in range(-warmup, repeats):
        for index, variant in enumerate(variants):
            sample = _time_once(variant)
            if repeat >= 0:
                samples[index].append(sample)
        progress(max(0, repeat + 1), repeats)
    return [_summary(v.labels, np.array(s)) for v, s in zip(variants, samples, strict=True)]


def measure_calls(
    calls: Mapping[Hashable, Callable[[], object]], warmup: int, repeats: int
) -> dict[Hashable, float]:
    """Median time in ms of each of ``calls`` over the repeats, interleaved; ``warmup`` before."""
    samples: dict[Hashable, list[float]] = {key: [] for key in calls}
    for repeat in range(-warmup, repeats):
        for key, call in calls.items():
            before = perf_counter()
            call()
            seconds = perf_counter() - before
            if repeat >= 0:
                samples[key].append(1e3 * seconds)
    return {key: float(np.median(values)) for key, values in samples.items()}


def clocked(made: Iterable[T]) -> Iterator[tuple[float, T]]:
    """Every item of ``made`` with the processor time that it took to make, s."""
    items = iter(made)
    while True:
        before = process_time()
        try:
            item = next(items)
        except StopIteration:
            return
        yield process_time() - before, item


_INNER = ("assembly_seconds", "lift_seconds")


def _time_once(variant: Variant) -> np.ndarray:
    """Milliseconds of each frame that ran: total, inertia, local, assembly, lift, global."""
    loop, state = variant.loop, variant.start
    rows = []
    with np.errstate(over="ignore", invalid="ignore"):
        for frame in range(variant.frames):
            _reset(loop)
            state, report = loop.step(state, frame)
            rows.append([*report.seconds, *(_inner(loop, name) for name in _INNER)])
            if not np.isfinite(state.positions).all():
                break
    start, local, solve, end, assembly, lift = np.array(rows).T
    repeated = np.array([local - assembly - lift, assembly, lift, solve]) / variant.share
    inertia = start + end
    return 1e3 * np.vstack([inertia + repeated.sum(axis=0), inertia, repeated]).T


def _reset(loop: Stepper) -> None:
    for step in loop.local_steps:
        for name in _INNER:
            if hasattr(step, name):
                setattr(step, name, 0.0)


def _inner(loop: Stepper, name: str) -> float:
    """Seconds of a phase inside the local steps."""
    return sum(getattr(step, name, 0.0) for step in loop.local_steps)


def _summary(labels: dict[str, object], samples: np.ndarray) -> Measurement:
    means = samples[:, :, 0].mean(axis=1)
    frame, inertia, local, assembly, lift, solve = median_frames(samples).tolist()
    low, high = float(means.min()), float(means.max())
    return Measurement(
        labels, frame, inertia, local, assembly, lift, solve, low, high, repeats=len(samples)
    )


def median_frames(samples: np.ndarray) -> np.ndarray:
    """Mean over the frames of ``samples`` (repeats, frames, phases) at each one's median repeat.

    The median is that of the total, the first phase. The phases of one repeat belong together,
    medians of each phase would not.
    """
    order = np.argsort(samples[:, :, 0], axis=0, kind="stable")[len(samples) // 2]
    return samples[order, np.arange(samples.shape[1])].mean(axis=0)
