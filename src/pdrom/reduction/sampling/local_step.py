"""The reduced local step: projections p(y) in S^T W p(y) become mean + V c(y), with r modes V.

S has the operators of all elements, W their weights. Compiled code computes the coefficients c from
sampled entries of p(y), then the reconstruction ("lift"). A column of the lift adds the
reconstruction of one set of coefficients (for one axis or all) to one axis of the result."""

from copy import copy
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.dots import dots
from pdrom.model.compiled.functions import clock, compiled, now
from pdrom.model.compiled.rows import WIDTH, as_vertices, at, flat, unflat
from pdrom.model.constraints import local_kernel as kernels
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.local_kernel import OWN, LocalKernel
from pdrom.model.dynamics.stepper import LocalStep
from pdrom.model.scene import Scene
from pdrom.reduction.sampling.reduction import Reduction

# Indices into the record (int64 array) of the kernel: numbers of modes, coefficient sets, columns
# (see `Lift`), samples; addresses of the sampling kernel, of its record and of all arrays.
MODES, SETS, COLUMNS, SAMPLED, SAMPLER, SAMPLER_RECORD = range(OWN, OWN + 6)
STARTS, POSITIONS, PACKED, OPERATORS, SHIFTS, COEFFICIENTS = range(OWN + 6, OWN + 12)
AXES, OWN_SETS, LIFTED, OFFSET, SECONDS, PROJECTIONS, CLOCK, SIZE = range(OWN + 12, OWN + 20)


@dataclass(frozen=True)
class Lift:
    """Arrays of a reduced local step: r modes, N vertices, sets of coefficients (one or three)."""

    starts: np.ndarray  # (sets + 1,) indices in ``positions`` where entries of each set begin
    positions: np.ndarray  # index of each sampled entry in the projections of sampled elements
    packed: np.ndarray  # working memory for the sampled entries of one set
    operators: np.ndarray  # matrix (r, m) of each set: m samples to coefficients, all flattened
    shifts: np.ndarray  # (sets, r) operator times the mean at sampled entries, to be subtracted
    coefficients: np.ndarray  # (sets, r) coefficients of the last evaluation
    axes: np.ndarray  # (c,) axis of each reconstructed column (x, y, z)
    own_sets: np.ndarray  # (c,) set of its coefficients
    lifted: np.ndarray  # (c, N, r) S^T W V of each column
    offset: np.ndarray  # (4 N,) S^T W mean, flat, with a zero after the numbers of each vertex
    seconds: np.ndarray  # (1,) s, accumulated time of the reconstruction


@compiled(nogil=True)
def coefficients(sampled, starts, positions, packed, operators, shifts, result):
    """Write the coefficients of ``sampled``, the flat projections of the sampled elements, to
    ``result`` (sets, r); the other arguments are arrays of `Lift`."""
    sets, modes = shifts.shape
    for k in range(sets):
        first, last = starts[k], starts[k + 1]
        # contiguous copy of the sampled entries for coefficient set k, to multiply by the operator
        for j in range(last - first):
            packed[j] = at(sampled, at(positions, first + j))
        size = last - first
        for i in range(0, modes, 3):
            # three modes at a time; if fewer than three are left, the last mode is repeated
            a, b, c = i, min(i + 1, modes - 1), min(i + 2, modes - 1)
            result[k, a], result[k, b], result[k, c] = dots(
                operators,
                first * modes + a * size,
                first * modes + b * size,
                first * modes + c * size,
                size,
                packed,
                (-shifts[k, a], -shifts[k, b], -shifts[k, c]),
            )


@compiled(nogil=True)
def lift(values, axes, own_sets, lifted, offset, rhs):
    """Add S^T W (mean + V c) to ``rhs`` (4 N,), flat, with a zero after the numbers of a vertex.

    ``values`` (sets, r) are the coefficients c; the other arguments are arrays of `Lift`.
    """
    for i in range(len(offset)):
        rhs[i] += offset[i]
    columns, vertices, modes = lifted.shape
    flat = lifted.reshape(columns * vertices * modes)
    for column in range(columns):
        own, axis, start = values[own_sets[column]], axes[column], column * vertices
        for vertex in range(0, vertices - 2, 3):
            i = (start + vertex) * modes
            x, y, z = dots(flat, i, i + modes, i + 2 * modes, modes, own, (0.0, 0.0, 0.0))
            rhs[WIDTH * vertex + axis] += x
            rhs[WIDTH * (vertex + 1) + axis] += y
            rhs[WIDTH * (vertex + 2) + axis] += z
        for vertex in range(vertices - vertices % 3, vertices):
            i = (start + vertex) * modes
            rhs[WIDTH * vertex + axis] += dots(flat, i, i, i, modes, own, (0.0, 0.0, 0.0))[0]


@kernels.local_kernel
def _accumulate(y, rhs_place, record):
    entries = rows.indices(record, SIZE)
    modes, sets, columns = entries[MODES], entries[SETS], entries[COLUMNS]
    values = rows.doubles(entries[COEFFICIENTS], sets * modes).reshape((sets, modes))
    starts = rows.indices(entries[STARTS], sets + 1)
    count = starts[sets]
    kernels.call(entries[SAMPLER], y, entries[PROJECTIONS], entries[SAMPLER_RECORD])
    coefficients(
        rows.doubles(entries[PROJECTIONS], entries[SAMPLED]),
        starts,
        rows.indices(entries[POSITIONS], count),
        rows.doubles(entries[PACKED], count),
        rows.doubles(entries[OPERATORS], count * modes),
        rows.doubles(entries[SHIFTS], sets * modes).reshape((sets, modes)),
        values,
    )
    vertices = entries[kernels.VERTICES]
    watch = rows.indices(entries[CLOCK], 2)
    before = now(watch)
    lift(
        values,
        rows.indices(entries[AXES], columns),
        rows.indices(entries[OWN_SETS], columns),
        rows.doubles(entries[LIFTED], columns * vertices * modes).reshape(
            (columns, vertices, modes)
        ),
        rows.doubles(entries[OFFSET], WIDTH * vertices),
        rows.doubles(rhs_place, WIDTH * vertices),
    )
    rows.doubles(entries[SECONDS], 1)[0] += now(watch) - before
    return np.nan


class ReducedLocalStep:
    """Local step that evaluates sampled elements and adds a reconstruction of S^T W p to rhs.

    S^T W mean (N, 3), S^T W V and the matrices that map samples to the coefficients c are computed
    before the run. An iteration does the rest: projections of sampled elements and dense products.

    local_kernel : the iteration in compiled form; None if the group has no compiled projections
    frame_lagged : whether the group has data that are computed once per frame (``begin_frame``)
    """

    def __init__(self, group: ConstraintGroup, reduction: Reduction) -> None:
        self.name, self.frame_lagged = group.name, group.frame_lagged
        self._elements = np.ascontiguousarray(reduction.elements, dtype=np.int64)
        self._everything = len(self._elements) == group.elements
        self._take(group, _lift(group, reduction))

    def _take(self, group: ConstraintGroup, lift: Lift) -> None:
        self._group, self._lift = group.for_run(), lift
        self.local_kernel: LocalKernel | None = None
        if self._group.local_kernel is not None:
            sampled = 3 * group.rows_per_element * len(self._elements)
            columns, vertices, modes = lift.lifted.shape
            sampler = self._group.sampler(self._elements)
            places = sampler.address, sampler.record.ctypes.data
            numbers = modes, len(lift.shifts), columns, sampled, *places
            # the kernel's record lists the arrays of `Lift` in the order of its fields
            own = *vars(lift).values(), np.empty(sampled), clock()
            arrays = *own, sampler.record, *sampler.arrays
            self.local_kernel = LocalKernel(_accumulate, vertices, arrays, numbers)

    def for_run(self) -> Self:
        """Return a copy of the step with separate memory for all that a run writes."""
        own, memory = copy(self), ("packed", "coefficients", "seconds")
        changed = {name: np.zeros_like(getattr(self._lift, name)) for name in memory}
        own._take(self._group, replace(self._lift, **changed))
        return own

    def begin_frame(self, q: np.ndarray) -> None:
        """Compute data that sampled elements need in a frame that starts at ``q`` (N, 3) m."""
        self._group.begin_frame(q, None if self._everything else self._elements)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the reduced S^T W p(``y``), (N, 3), to ``rhs``; return nan for the unknown energy."""
        if self.local_kernel is not None:
            return self.local_kernel.accumulate(y, rhs)
        self.solve(self.sample(y))
        self.lift(rhs)
        return float("nan")

    def sample(self, y: np.ndarray) -> np.ndarray:
        """Compute projections of the sampled elements at ``y`` (N, 3) m, as one vector."""
        return self._group.project_elements(y, self._elements).ravel()

    def solve(self, sampled: np.ndarray) -> None:
        """Compute the coefficients of the reconstruction from ``sampled``, result of `sample`."""
        data = self._lift
        coefficients(
            sampled, data.starts, data.positions, data.packed, data.operators, data.shifts,
            data.coefficients,
        )  # fmt: skip

    def lift(self, rhs: np.ndarray) -> None:
        """Add S^T W (mean + V c) with the coefficients of the last `solve` to ``rhs`` (N, 3)."""
        data, added = self._lift, np.zeros(len(self._lift.offset))
        lift(data.coefficients, data.axes, data.own_sets, data.lifted, data.offset, added)
        rhs += unflat(added)

    @property
    def lift_seconds(self) -> float:
        """Accumulated time of the reconstruction, s."""
        return float(self._lift.seconds[0])

    @lift_seconds.setter
    def lift_seconds(self, seconds: float) -> None:
        self._lift.seconds[:] = seconds


def _lift(group: ConstraintGroup, reduction: Reduction) -> Lift:
    mean, blocks, r = reduction.basis.mean, reduction.blocks, reduction.r
    operator = group.S.T.multiply(group.row_weights[None, :]).tocsr()
    vertices = operator.shape[0]
    # map indices of the full projection vector to indices of the sampled elements' projections
    size = 3 * reduction.basis.rows_per_element
    entries = np.concatenate([np.empty(0, np.int64), *(block.entries for block in blocks)])
    element, inside = np.divmod(entries, size)
    order = np.argsort(reduction.elements, kind="stable")
    places = order[np.searchsorted(reduction.elements[order], element)]
    every = [range(3) if block.axis is None else (block.axis,) for block in blocks]
    columns = [(axis, k) for k, axes in enumerate(every) for axis in axes]
    lifted = np.zeros((len(columns), vertices, r))
    for own, (axis, _) in zip(lifted, columns, strict=True):
        own[...] = operator @ reduction.v[axis::3]
    return Lift(
        starts=np.cumsum([0, *(len(block.entries) for block in blocks)], dtype=np.int64),
        positions=size * places + inside,
        packed=np.empty(len(entries)),
        operators=np.concatenate([np.empty(0), *(block.operator.ravel() for block in blocks)]),
        shifts=np.array([b.operator @ mean[b.entries] for b in blocks]).reshape(-1, r),
        coefficients=np.zeros((len(blocks), r)),
        axes=np.array([axis for axis, _ in columns], dtype=np.int64),
        own_sets=np.array([k for _, k in columns], dtype=np.int64),
        lifted=lifted,
        offset=flat(as_vertices(operator @ mean.reshape(-1, 3))),
        seconds=np.zeros(1),
    )


def replace_group(scene: Scene, group: str, replacement: LocalStep) -> list[LocalStep]:
    """Return local steps of ``scene``, with ``replacement`` for the constraint ``group``."""
    scene.group(group)
    return [replacement if g.name == group else g for g in scene.groups]
