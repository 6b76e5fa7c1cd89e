"""Time of local steps alone: the reduced ones and the full one of their group (claim C9)."""

from collections.abc import Callable, Hashable, Mapping, Sequence

import numpy as np
import pandas as pd

from pdrom.model.compiled.rows import as_vertices, vertices
from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from pdrom.reduction.local.local_step import ReducedLocalStep
from study.experiments.kit.measurement import Variant, measure_calls

COLUMNS = [
    "scene", "group", "method", "vertices", "elements", "r", "local_ms", "full_ms", "solve_ms",
    "lift_ms",
]  # fmt: skip


def variant(
    scene: Scene,
    system: GlobalSystem,
    steps: Sequence[LocalStep],
    frames: int,
    labels: dict[str, object],
) -> Variant:
    """Loop of a ``scene`` with these local ``steps`` and no objective, from its own start."""
    loop = scene.stepper(system, steps, track_objective=False)
    return Variant(labels, loop, scene.initial_state(), frames)


def local_costs(
    scene: Scene,
    reduced: Mapping[tuple[str, str, int], ReducedLocalStep],
    states: np.ndarray,
    warmup: int,
    repeats: int,
) -> pd.DataFrame:
    """Milliseconds of one local step, mean over some states.

    Of a reduced one also the dense product that solves for its coefficients, and its
    reconstruction, alone.

    All steps are interleaved.

    Parameters
    ----------
    warmup, repeats : evaluations before the clock starts, and measured ones
    reduced : local steps by group, method and r, bound to the groups of ``scene``
    states : (n, N, 3) positions in m; frame-lagged data are those of the first
    """
    groups = {name: scene.group(name) for name, _, _ in reduced}
    steps: dict[Hashable, LocalStep] = {}
    for name, group in groups.items():
        steps[name] = group
    for key, step in reduced.items():
        steps[key] = step
    calls = {key: _all_states(step, states) for key, step in steps.items()}
    for key, own in reduced.items():
        calls["solve", key], calls["lift", key] = _solve_and_lift(own, states)
    with np.errstate(over="ignore", invalid="ignore"):
        times = measure_calls(calls, warmup, repeats)
    rows = []
    for key in reduced:
        name, method, r = key
        measured = (times[key], times[name], times["solve", key], times["lift", key])
        means = (time / len(states) for time in measured)
        labels = (scene.config.name, name, method, scene.mesh.vertices, groups[name].elements, r)
        rows.append((*labels, *means))
    return pd.DataFrame(rows, columns=COLUMNS)


def _solve_and_lift(
    step: ReducedLocalStep, states: np.ndarray
) -> tuple[Callable[[], None], Callable[[], None]]:
    """The two dense parts of a reduced local step over all states."""
    rhs = vertices(len(states[0]))
    step.begin_frame(states[0])
    sampled = [step.sample(y) for y in states]

    def solve() -> None:
        for values in sampled:
            step.solve(values)

    def lift() -> None:
        for _ in states:
            step.lift(rhs)

    return solve, lift


def _all_states(step: LocalStep, states: np.ndarray) -> Callable[[], None]:
    rhs, iterates = vertices(len(states[0])), [as_vertices(y) for y in states]
    step.begin_frame(states[0])

    def call() -> None:
        for y in iterates:
            step.accumulate(y, rhs)

    return call
