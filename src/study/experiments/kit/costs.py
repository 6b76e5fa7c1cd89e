"""Time single local steps, each effect in a frame, and frames without some effects.

Wrappers measure the times of effects, so that a normal run contains no timers.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from copy import copy
from functools import partial
from itertools import combinations
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import clock, now
from pdrom.model.compiled.rows import as_vertices, vertices
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.local_kernel import OWN, LocalKernel, call, local_kernel
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import LocalStep, Stepper
from pdrom.model.effects.base import Effect
from pdrom.model.scene import Scene
from pdrom.reduction.sampling.local_step import ReducedLocalStep
from pdrom.reduction.timing import Variant, measure, measure_calls, median_frames
from study.experiments.kit.base import GLOBAL, REST, RIGHT

COLUMNS = [
    "scene", "group", "method", "vertices", "elements", "r", "local_ms", "full_ms", "solve_ms",
    "lift_ms",
]  # fmt: skip
COSTS = ["scene", "effect", "elements", "ms_per_frame", "share"]
LEFT_OUT = ["scene", "left_out", "groups", "elements", "ms_per_frame", "own_ms"]
# Python methods that the step loop calls, for groups, forces, boundaries and contacts.
_QUESTIONS = (
    ("begin_frame", "accumulate"), ("acceleration",),
    ("active", "held", "takes_hold", "anchor", "path"), ("apply",),
)  # fmt: skip
# Indices into the data array ("record") of a kernel with a timer. Its entries are the addresses of
# the kernel without a timer, its record, the summed time, the clock. SIZE: length of the array.
KERNEL, RECORD, SECONDS, CLOCK, SIZE = range(OWN, OWN + 5)


def variant(
    scene: Scene, frames: int, labels: dict, steps: Sequence[LocalStep] | None = None
) -> Variant:
    """Return a run to be timed: the full-order model, with other local ``steps`` if given.

    No objective is computed.
    """
    loop = scene.stepper(local_steps=steps, track_objective=False)
    return Variant(labels, loop, scene.initial_state(), frames)


def local_costs(
    scene: Scene, reduced: Mapping[tuple, ReducedLocalStep], states: np.ndarray, **often: int
) -> pd.DataFrame:
    """Time an evaluation (ms) of each reduced local step, and of the full step of its group.

    Times are means over ``states``. A row also has times of two phases of the reduced local step,
    measured separately: the dense product that gives the coefficients c of the modes, and the sum
    S^T W (mean + V c) over all elements.

    reduced : (group, method, r) -> reduced local step of a group of ``scene``
    states : (n, N, 3) m, positions; the local steps prepare a frame that begins at states[0]
    """
    groups = {name: scene.group(name).for_run() for name, _, _ in reduced}
    rhs, iterates = vertices(len(states[0])), [as_vertices(y) for y in states]
    calls: dict[Hashable, Callable[[], None]] = {}
    steps: list[tuple[Hashable, LocalStep]] = [*groups.items(), *reduced.items()]
    for key, step in steps:
        step.begin_frame(states[0])
        calls[key] = partial(_each, step.accumulate, [(y, rhs) for y in iterates])
    for key, own in reduced.items():
        calls["solve", key] = partial(_each, own.solve, [(own.sample(y),) for y in states])
        calls["lift", key] = partial(_each, own.lift, [(rhs,) for _ in states])
    with np.errstate(over="ignore", invalid="ignore"):
        times = measure_calls(calls, **often)
    rows = []
    for key in reduced:
        name, method, r = key
        measured = (times[key], times[name], times["solve", key], times["lift", key])
        means = (time / len(states) for time in measured)
        labels = (scene.config.name, name, method, scene.mesh.vertices, groups[name].elements, r)
        rows.append((*labels, *means))
    return pd.DataFrame(rows, columns=COLUMNS)


def _each(call: Callable[..., object], arguments: Sequence[tuple]) -> None:
    """Call ``call`` once with each tuple in ``arguments``."""
    for own in arguments:
        call(*own)


class Timed:
    """Wrapper of an effect that adds up the time of the methods that the step loop calls.

    local_kernel : for a constraint group, its kernel with a timer in compiled code; else None
    """

    def __init__(self, effect: Effect, questions: Sequence[str]) -> None:
        self.name = effect.name
        self._asked, self._kernel = 0.0, np.zeros(1)
        self.local_kernel: LocalKernel | None = None
        if isinstance(effect, ConstraintGroup):
            effect = effect.for_run()
            if effect.local_kernel is not None:
                self.local_kernel, self._kernel = timed(effect.local_kernel)
        for question in questions:
            setattr(self, question, self._timed(getattr(effect, question)))

    @property
    def seconds(self) -> float:
        """Seconds spent in the effect since the last call of `reset`."""
        return self._asked + self.kernel_seconds

    @property
    def kernel_seconds(self) -> float:
        """Seconds spent in compiled code of the effect since the last call of `reset`."""
        return float(self._kernel[0])

    def reset(self) -> None:
        """Set all times to zero."""
        self._asked = 0.0
        self._kernel[:] = 0.0

    def _timed(self, ask: Callable[..., Any]) -> Callable[..., Any]:
        def answer(*arguments: Any) -> Any:
            before = perf_counter()
            result = ask(*arguments)
            self._asked += perf_counter() - before
            return result

        return answer


def effect_costs(scene: Scene, frames: int, warmup: int, repeats: int) -> pd.DataFrame:
    """Time a frame of the full-order run: effects, right-hand side, global solve, the rest.

    The table has the columns `COSTS`; several effects of one name have one row. ``elements`` counts
    the elements of a group, the vertices that pins or handles may fix, or else all vertices. The
    right-hand side includes the time of compiled local steps outside the groups' kernels.
    """
    questions = zip(_roles(scene), _QUESTIONS, strict=True)
    by_role: Any = [[Timed(effect, asked) for effect in role] for role, asked in questions]
    groups, *others = by_role
    space, config = VertexSpace(scene.system, *others), scene.config
    loop = Stepper(space, config.time_step, config.count, groups, track_objective=False)
    stands = [stand for role in by_role for stand in role]
    names = list(dict.fromkeys(stand.name for stand in stands))
    samples = [_profile(loop, scene, frames, stands, names) for _ in range(warmup + repeats)]
    total, *parts = median_frames(np.array(samples[warmup:]))
    phases = [*names, RIGHT, GLOBAL, REST]
    costs = pd.DataFrame({"scene": config.name, "effect": phases, "ms_per_frame": parts})
    costs["elements"] = [_elements(scene, phase) for phase in phases]
    costs["share"] = costs.ms_per_frame / total
    return costs[COSTS]


def _roles(scene: Scene) -> tuple[Sequence[Effect], ...]:
    return scene.groups, scene.forces, scene.boundaries, scene.contacts


def _profile(
    loop: Stepper, scene: Scene, frames: int, stands: list[Timed], names: list[str]
) -> list[list[float]]:
    """Return times of each frame, ms: total, effects, right-hand side, global solve, the rest."""
    state, rows = scene.initial_state(), []
    for frame in range(frames):
        for stand in stands:
            stand.reset()
        state, report = loop.step(state, frame)
        own = [sum(stand.seconds for stand in stands if stand.name == name) for name in names]
        inside = sum(stand.kernel_seconds for stand in stands)
        total, (_, local, solve, _) = float(report.seconds.sum()), report.seconds.tolist()
        # without compiled kernels, a group's time includes that of the right-hand side
        right = local - inside if inside > 0.0 else 0.0
        parts = [*own, right, solve, total - sum(own) - right - solve]
        rows.append([1e3 * part for part in (total, *parts)])
    return rows


def _elements(scene: Scene, name: str) -> int:
    """Count elements of group ``name``, else vertices held by effect ``name``, or all vertices."""
    for group in scene.groups:
        if group.name == name:
            return group.elements
    held = [b.vertices for b in scene.boundaries if b.name == name]
    return len(np.unique(np.concatenate(held))) if held else scene.mesh.vertices


def left_out_sets(scene: Scene) -> list[tuple[str, ...]]:
    """List the sets of effects to leave out: none; each effect; for each group, all other groups.

    The list is empty for a scene with a single constraint group, which cannot be left out. Effects
    that only change the start, for example a kick, are never left out.
    """
    groups = scene.config.groups
    if len(groups) < 2:
        return []
    lasting = {effect.name for role in _roles(scene) for effect in role}
    listed = dict.fromkeys(e.effect for e in scene.config.effects)
    single = [(name,) for name in listed if name in lasting]
    several = combinations(groups, len(groups) - 1) if len(groups) > 2 else ()
    return [(), *single, *several]


def left_out(
    scene: Scene, costs: pd.DataFrame, frames: int, warmup: int, repeats: int
) -> pd.DataFrame:
    """Time a frame of the scene built without some of its effects; the columns are `LEFT_OUT`.

    Column ``own_ms`` is the time that the omitted effects take in the complete scene, from the
    table ``costs`` of `effect_costs`.
    """
    sets = left_out_sets(scene)
    if not sets:
        return pd.DataFrame(columns=LEFT_OUT)
    variants = []
    for names in sets:
        part = scene.changed(effects=scene.config.effects_without(*names))
        own = costs.set_index("effect").loc[list(names)]
        labels = {
            "scene": scene.config.name,
            "left_out": " + ".join(names) or "nothing",
            "groups": len(part.groups),
            "elements": int(own.elements.sum()),
            "own_ms": float(own.ms_per_frame.sum()),
        }
        variants.append(variant(part, frames, labels))
    return pd.DataFrame(measure(variants, warmup, repeats))[LEFT_OUT]


@local_kernel
def _timed(y, rhs, record):
    entries = rows.indices(record, SIZE)
    watch = rows.indices(entries[CLOCK], 2)
    before = now(watch)
    energy = call(entries[KERNEL], y, rhs, entries[RECORD])
    rows.doubles(entries[SECONDS], 1)[0] += now(watch) - before
    return energy


def timed(kernel: LocalKernel) -> tuple[LocalKernel, np.ndarray]:
    """Return ``kernel`` with a timer, and the seconds (1,) spent in it."""
    arrays = seconds, _ = np.zeros(1), clock()
    places = [kernel.address, kernel.record.ctypes.data, *(array.ctypes.data for array in arrays)]
    record = np.concatenate([kernel.record[:OWN], np.array(places, dtype=np.int64)])
    same = copy(kernel)
    same.function, same.record = _timed, record
    same.arrays = (*arrays, kernel.record, *kernel.arrays)
    return same, seconds
