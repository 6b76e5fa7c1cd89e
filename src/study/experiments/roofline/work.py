"""Work of one iteration of the full-order run: what each phase reads, writes and computes.

Bytes are those of the arrays themselves, each counted once a phase, and of the lines that gathers
and scatters fetch; their visits of vertices, which move a vector each, are counted beside
(`study.experiments.roofline.gathers`). Operations of a local kernel are counted while it runs
(`study.experiments.roofline.counters`), those of the sweeps follow from the factor.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.local_kernel import LocalPass
from pdrom.model.dynamics.solvers import Factor
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from study.experiments.kit.names import GLOBAL, RIGHT
from study.experiments.roofline.counted_kernel import operations
from study.experiments.roofline.counters import Operations
from study.experiments.roofline.gathers import LINE, fetched, visits

COLUMNS = [
    "scene", "factor", "vertices", "phase", "elements", "bytes", "touches", "flops", "divisions",
    "roots", "working_set",
]  # fmt: skip
VECTOR = 8 * WIDTH  # bytes of a vertex
# vectors an unknown that the sweeps read or write: right-hand side and load in, the working array
# out, then in and out twice and in once more, the solution out
_SWEPT = 9


def work(scene: Scene, system: GlobalSystem, frames: int) -> Iterator[dict[str, Any]]:
    """Rows of `COLUMNS` but for the factor; operations are means over ``frames`` from the start.

    Groups without a compiled local step have no row, other solvers than the compiled one none.
    """
    state = scene.initial_state()
    fixed, _ = scene.space(system).fixed(0, state.positions)
    factor = system.eliminate(fixed).factor
    groups = [group for group in scene.groups if group.local_kernel is not None]
    counted = _counted(scene, system, groups, frames)
    phases = [
        (g.name, g.elements, _local_bytes(g), 3 * sum(map(len, visits(g))), o)
        for g, o in zip(groups, counted, strict=True)
    ]
    phases.append((RIGHT, scene.mesh.vertices, *_right_hand_side(scene, groups)))
    if factor is not None:
        phases.append((GLOBAL, scene.mesh.vertices, *_sweeps(factor)))
    labels = {
        "scene": scene.config.name,
        "vertices": scene.mesh.vertices,
        "working_set": _working_set(scene, groups, factor),
    }
    for phase, elements, size, touches, own in phases:
        counts = {"elements": elements, "bytes": size, "touches": touches, **asdict(own)}
        yield {**labels, "phase": phase, **counts}


def _counted(
    scene: Scene, system: GlobalSystem, groups: Sequence[ConstraintGroup], frames: int
) -> list[Operations]:
    """Mean operations of each group's kernel at the ends of the frames."""
    loop, state = scene.stepper(system, track_objective=False), scene.initial_state()
    totals = np.zeros((len(groups), 3))
    for frame in range(frames):
        state, _ = loop.step(state, frame)
        for k, group in enumerate(groups):
            assert group.local_kernel is not None
            own = operations(group.local_kernel, state.positions)
            totals[k] += (own.flops, own.divisions, own.roots)
    return [Operations(*row) for row in (totals / frames).tolist()]


def _local_bytes(group: ConstraintGroup) -> int:
    """The group's own arrays; lines of positions are read, of the right-hand side written, too."""
    read, changed = fetched(group)
    return sum(array.nbytes for array in group.streamed) + LINE * (read + 2 * changed)


def _right_hand_side(
    scene: Scene, groups: Sequence[ConstraintGroup]
) -> tuple[int, int, Operations]:
    """(M/h^2) s is copied; second parts are cleared, read and added."""
    kernels = [group.local_kernel for group in groups if group.local_kernel is not None]
    touched = len(LocalPass(kernels).touched)
    size = VECTOR * (2 * scene.mesh.vertices + 4 * touched)
    return size, 0, Operations(WIDTH * touched, 0, 0)


def _sweeps(factor: Factor) -> tuple[int, int, Operations]:
    """The factor is read forward and backward, a product and a sum for each entry and lane.

    Rows below a panel are read and written forward, read backward.
    """
    panels, vertices, _, _ = factor
    entries, unknowns = len(panels[-1]) - len(vertices), len(vertices)
    size = 2 * sum(array.nbytes for array in panels) + 2 * vertices.nbytes
    flops = WIDTH * (2 * 2 * entries + 2 * unknowns)
    touches = 3 * len(panels[-2])
    return size + _SWEPT * VECTOR * unknowns, touches, Operations(flops, 0, 0)


def _working_set(scene: Scene, groups: Sequence[ConstraintGroup], factor: Factor | None) -> int:
    """Bytes of all arrays that an iteration goes through."""
    size = sum(array.nbytes for group in groups for array in group.streamed)
    size += 3 * VECTOR * scene.mesh.vertices  # iterate, right-hand side, (M/h^2) s
    if factor is not None:
        panels, *others = factor
        size += sum(array.nbytes for array in (*panels, *others))
    return size
