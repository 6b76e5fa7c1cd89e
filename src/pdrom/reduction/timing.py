"""Timing of step loops ("variants"), alternately, after a warm-up.

Each repeat runs every variant once from its initial state, so that changes of the processor's clock
rate affect all variants alike. For each frame, the time of the median repeat is used: an
interruption by another program affects one frame of one repeat only.
"""

import logging
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.deviations import Reduced

log = logging.getLogger(__name__)

# Columns of the times of a frame: the total; prediction, contacts and velocities; projections of
# all groups and coefficients of reduced groups; product of projections with S^T W, if it is
# separate from them; right-hand side from coefficients; global step; positions of all vertices, if
# the loop has coordinates in a subspace.
PHASES = (
    "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms", "global_ms", "vertices_ms",
)  # fmt: skip
_INNER = ("assembly_seconds", "lift_seconds")


@dataclass(frozen=True)
class Variant:
    """A step loop to time.

    share : fraction of a frame's iterations that the loop does; the times of phases inside the
        iterations are divided by it
    output : function of coordinates in a subspace that returns the positions of all vertices; it is
        called after every ``steps`` steps of the loop
    starts : pairs (state, number of the next step); if there are any, ``steps`` steps are timed
        from each of them in turn, in place of the first ``frames``
    """

    labels: dict[str, Any]  # first columns of the variant's row in the table of times
    loop: Stepper
    start: State  # before the first frame
    frames: int
    share: float = 1.0
    output: Callable[[np.ndarray], np.ndarray] | None = None
    steps: int = 1
    starts: tuple[tuple[State, int], ...] = ()
    warm: int | None = None  # number of frames of an unmeasured run; None for ``frames``


def model_variant(labels: dict[str, Any], scene: Scene, model: Reduced, frames: int) -> Variant:
    """Return a variant to be timed: the first ``frames`` frames of ``scene`` with ``model``."""
    return Variant(labels, *model.loop(scene), frames, output=model.output())


def measure(variants: Sequence[Variant], warmup: int, repeats: int) -> list[dict[str, Any]]:
    """Time all variants; return a row for each: labels, and times of the `PHASES` in ms.

    Times are means over the frames (`median_frames`). Of each variant there are ``warmup``
    unmeasured runs, the first of which also factorises matrices, and ``repeats`` measured runs.
    """
    samples: list[list[np.ndarray]] = [[] for _ in variants]
    for repeat in range(-warmup, repeats):
        for own, variant in zip(samples, variants, strict=True):
            frames = variant.frames if repeat >= 0 else variant.warm or variant.frames
            own.append(_time_once(variant, frames))
        log.info("timing: repeat %d of %d", max(0, repeat + 1), repeats)
    times = [median_frames(np.array(own[warmup:])).tolist() for own in samples]
    return [
        {**variant.labels, **dict(zip(PHASES, own, strict=True))}
        for variant, own in zip(variants, times, strict=True)
    ]


def measure_calls(
    calls: Mapping[Hashable, Callable[[], object]], warmup: int, repeats: int
) -> dict[Hashable, float]:
    """Return the median time (ms) of each of ``calls``, in turn, after ``warmup`` calls of each."""
    samples: dict[Hashable, list[float]] = {key: [] for key in calls}
    for _ in range(warmup + repeats):
        for key, call in calls.items():
            before = perf_counter()
            call()
            samples[key].append(1e3 * (perf_counter() - before))
    return {key: float(np.median(values[warmup:])) for key, values in samples.items()}


def _time_once(variant: Variant, frames: int) -> np.ndarray:
    """Run a variant, up to the first frame that is not finite; return ms (frames, `PHASES`)."""
    loop, state, rows = variant.loop, variant.start, []
    frame = -1
    with np.errstate(over="ignore", invalid="ignore"):
        for number in range(frames):
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
    """Compute the mean time (phases,) over frames of ``samples`` (repeats, frames, phases).

    Times of a frame are those of the repeat with the median total (the first phase).
    """
    order = np.argsort(samples[:, :, 0], axis=0, kind="stable")[len(samples) // 2]
    return samples[order, np.arange(samples.shape[1])].mean(axis=0)
