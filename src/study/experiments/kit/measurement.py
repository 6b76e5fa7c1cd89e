"""Timing of step loops ("variants"), alternately, after a warm-up.

A variant is a step loop with its initial state. Each repeat runs every variant once from its
initial state, so that changes of the processor's clock rate affect all variants alike. For each
frame, the time of the median repeat is used: an interruption by another program affects one frame
of one repeat only.

Times also depend on the addresses of arrays and code in a process, by more than repeats differ.
Only new processes (`in_processes`) show this dependence, since a fork inherits the addresses.
"""

import logging
import pickle
import subprocess
import sys
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from pdrom.core.errors import PdromError
from pdrom.core.store.checksum import damaged_set_aside
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.subspace.model import SubspaceModel
from study.artifact import planned
from study.experiments.kit.base import Count, Repeats

log = logging.getLogger(__name__)

# Columns of the times of a frame: the total; prediction, contacts and velocities; projections of
# all groups and coefficients of reduced groups; product of projections with S^T W, if it is
# separate from them; right-hand side from coefficients; global step; positions of all vertices, if
# the loop has coordinates in a subspace.
PHASES = (
    "ms_per_frame", "inertia_ms", "local_ms", "assembly_ms", "lift_ms", "global_ms", "vertices_ms",
)  # fmt: skip
_INNER = ("assembly_seconds", "lift_seconds")


class Protocol(ConfigModel):
    """Settings of a timing: ``warmup`` untimed and ``repeats`` timed runs of ``frames`` frames."""

    frames: Count = 10
    warmup: Annotated[int, Field(ge=0, le=1000)] = 1
    repeats: Repeats = 5


class Processes(Protocol):
    """Settings of a timing done in each of ``processes`` new processes, one after the other."""

    frames: Count = 4
    repeats: Repeats = 3
    processes: Repeats = 10


@dataclass(frozen=True)
class Variant:
    """A step loop to time.

    labels : first columns of its row in the table of times
    loop, start, frames : step loop, state before the first frame, number of frames
    share : fraction of a frame's iterations that the loop does; the times of phases inside the
        iterations are divided by it
    output : function of coordinates in a subspace that returns the positions of all vertices; it is
        called after every ``steps`` steps of the loop
    starts : pairs (state, number of the next step); if there are any, ``steps`` steps are timed
        from each of them in turn, in place of the first ``frames``
    warm : number of frames of an unmeasured run; None for ``frames``
    """

    labels: dict[str, Any]
    loop: Stepper
    start: State
    frames: int
    share: float = 1.0
    output: Callable[[np.ndarray], np.ndarray] | None = None
    steps: int = 1
    starts: tuple[tuple[State, int], ...] = ()
    warm: int | None = None


def model_variant(
    labels: dict[str, Any], scene: Scene, model: SubspaceModel | ProjectionModel, frames: int
) -> Variant:
    """Return a variant to be timed: the first ``frames`` frames of ``scene`` with ``model``."""
    return Variant(labels, *model.loop(scene), frames, output=model.output())


def measure(variants: Sequence[Variant], warmup: int, repeats: int) -> list[dict[str, Any]]:
    """Time all variants; return a row for each: labels, and times of the `PHASES` in ms.

    Times are means over the frames; those of a frame are from the repeat with the median total time
    of the frame. Of each variant there are ``warmup`` unmeasured runs, the first of which also
    factorises and caches matrices, and ``repeats`` measured runs.
    """
    samples: list[list[np.ndarray]] = [[] for _ in variants]
    for repeat in range(-warmup, repeats):
        for own, variant in zip(samples, variants, strict=True):
            frames = variant.frames if repeat >= 0 else variant.warm or variant.frames
            own.append(_time_once(variant, frames))
        log.info("repeat %d of %d", max(0, repeat + 1), repeats)
    times = [median_frames(np.array(own[warmup:])).tolist() for own in samples]
    return [
        {**variant.labels, **dict(zip(PHASES, own, strict=True))}
        for variant, own in zip(variants, times, strict=True)
    ]


def measure_calls(
    calls: Mapping[Hashable, Callable[[], object]], warmup: int, repeats: int
) -> dict[Hashable, float]:
    """Median time (ms) of each of ``calls``, in turn, after ``warmup`` untimed calls of each."""
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
    """Mean time (phases,) over frames of ``samples`` (repeats, frames, phases).

    Each frame's times are those of the repeat with the median total (the first phase),
    since medians of single phases would not add up to the total.
    """
    order = np.argsort(samples[:, :, 0], axis=0, kind="stable")[len(samples) // 2]
    return samples[order, np.arange(samples.shape[1])].mean(axis=0)


def in_processes(
    cases: Sequence[Callable[[], Iterable[Variant]]], asked: Processes
) -> list[dict[str, Any]]:
    """Time all variants in several new processes; return a row per variant and process.

    The processes run one after the other, each with the variants in a random order of its own. They
    get the pickled functions ``cases``, which make the variants. Column ``processor_share`` is a
    process's processor time over the time that has passed. PdromError if a process fails.
    """
    rows: list[dict[str, Any]] = []
    command = [sys.executable, "-m", planned.__name__, __name__]
    with TemporaryDirectory() as folder:
        given, answer = Path(folder, "cases.pickle"), Path(folder, "rows.pickle")
        given.write_bytes(pickle.dumps((cases, asked)))
        for process in range(1, asked.processes + 1):
            ended = subprocess.run(
                [*command, str(given), str(answer), str(process)],
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
    """Time variants made by functions in pickle ``given``; write the rows to pickle ``answer``."""
    with damaged_set_aside():  # a damaged file is renamed when read, as in the parent process
        cases, asked = pickle.loads(Path(given).read_bytes())
        variants = [variant for case in cases for variant in case()]
        order = np.random.default_rng(int(process)).permutation(len(variants))
        begin, used = perf_counter(), process_time()
        measured = measure([variants[i] for i in order], asked.warmup, asked.repeats)
        share = (process_time() - used) / (perf_counter() - begin)
    told = {"process": int(process), "processor_share": share}
    rows = [{**measured[i], **told} for i in np.argsort(order)]
    Path(answer).write_bytes(pickle.dumps(rows))


if __name__ == "__main__":
    _in_this_process(*sys.argv[1:])
