"""Honest timings: in-process, warm, interleaved between the compared variants, median.

A variant makes a step loop and its initial state. Every repeat runs each variant once, from there,
so that drifts of the machine's clock hit all variants alike.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdrom.fom.stepper import State, Stepper


@dataclass(frozen=True)
class Variant:
    """What is timed: labels for the table, the loop with its first state, and how many frames."""

    labels: dict[str, object]
    loop: Stepper
    start: State
    frames: int


@dataclass(frozen=True)
class Measurement:
    """The repeat with the median time per frame: its mean times per frame in ms, by phase.

    ``spread`` is the interquartile range of the time per frame over the repeats.
    """

    labels: dict[str, object]
    frame: float
    local: float
    assembly: float
    solve: float
    spread: float
    repeats: int


def measure(
    variants: Sequence[Variant],
    warmup: int,
    repeats: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Measurement]:
    """Time all variants; factorisations are cached by the first run, the warm-up."""
    samples: list[list[np.ndarray]] = [[] for _ in variants]
    for repeat in range(-warmup, repeats):
        for index, variant in enumerate(variants):
            sample = _time_once(variant)
            if repeat >= 0:
                samples[index].append(sample)
        progress(max(0, repeat + 1), repeats)
    return [_summary(v.labels, np.array(s)) for v, s in zip(variants, samples, strict=True)]


def _time_once(variant: Variant) -> np.ndarray:
    """Mean milliseconds per frame: total, local, assembly, global."""
    loop, state = variant.loop, variant.start
    for step in loop.local_steps:
        if hasattr(step, "assembly_seconds"):
            step.assembly_seconds = 0.0
    seconds, done = 0.0, 0
    with np.errstate(over="ignore", invalid="ignore"):
        for frame in range(variant.frames):
            state, report = loop.step(state, frame)
            seconds, done = seconds + report.seconds, done + 1
            if not np.isfinite(state.positions).all():
                break
    assembly = sum(getattr(step, "assembly_seconds", 0.0) for step in loop.local_steps)
    local = seconds[1] - assembly
    return 1e3 / done * np.array([seconds.sum(), local, assembly, seconds[2]])


def _summary(labels: dict[str, object], samples: np.ndarray) -> Measurement:
    # the phases of one repeat belong together, medians of each phase would not
    middle = np.argsort(samples[:, 0], kind="stable")[len(samples) // 2]
    frame, local, assembly, solve = samples[middle]
    spread = float(np.subtract(*np.percentile(samples[:, 0], [75, 25])))
    return Measurement(labels, frame, local, assembly, solve, spread, len(samples))
