"""The reduced local step: S^T W p(y) is replaced by S^T W (mean + V c(y))."""

from collections.abc import Callable

import numpy as np

from pdrom.model.compiled.rows import as_vertices, flat, shares, unflat
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.constraints.local_kernel import LocalKernel, LocalPass
from pdrom.reduction.local.lift import Lift, coefficients, lift
from pdrom.reduction.sampling.reduction import Reduction


class ReducedLocalStep:
    """Evaluates sampled elements of a group and lifts their coefficients to the right-hand side.

    Precomputed: the offset S^T W mean (N, 3), the reconstruction S^T W V for each coefficient
    block, and the solution operators. Online: the projections of the sampled elements, a small
    dense product for c, and the dense reconstruction.

    Attributes
    ----------
    local_kernel : all of this as compiled code; None for a group without a sampler
    """

    def __init__(self, group: ConstraintGroup, reduction: Reduction) -> None:
        """Precompute what ``reduction`` of ``group`` needs online."""
        self.name = group.name
        self._group = group
        self._elements = np.ascontiguousarray(reduction.elements, dtype=np.int64)
        self._everything = len(self._elements) == group.elements
        self._lift = _lift(group, reduction)
        self.local_kernel: LocalKernel | None = None
        self._pass: LocalPass | None = None
        if getattr(group, "local_kernel", None) is not None:
            sampled = 3 * group.rows_per_element * len(self._elements)
            self.local_kernel = self._lift.kernel(group.sampler(self._elements), sampled)
            self._pass = LocalPass([self.local_kernel])

    @property
    def frame_lagged(self) -> bool:
        """Whether ``begin_frame`` freezes anything."""
        return self._group.frame_lagged

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze frame-lagged data of the sampled elements at positions ``q`` (N, 3) m."""
        self._group.begin_frame(q, None if self._everything else self._elements)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the reduced S^T W p(y) of ``y`` (N, 3) m to ``rhs`` (N, 3); energy unknown: nan."""
        if self._pass is not None:
            return self._pass.accumulate(y, rhs)
        self.solve(self.sample(y))
        self.lift(rhs)
        return float("nan")

    def sample(self, y: np.ndarray) -> np.ndarray:
        """Projections of the sampled elements at ``y`` (N, 3) m, as one vector."""
        return self._group.project_elements(y, self._elements).ravel()

    def solve(self, sampled: np.ndarray) -> None:
        """Set the coefficients from ``sampled`` (`sample`); the systems are inverted already."""
        data = self._lift
        coefficients(
            sampled, data.starts, data.positions, data.packed, data.operators, data.shifts,
            data.coefficients,
        )  # fmt: skip

    def lift(self, rhs: np.ndarray) -> None:
        """Add S^T W (mean + V c) with the coefficients of the last `solve` to ``rhs`` (N, 3)."""
        data, right = self._lift, flat(rhs)
        added = right if shares(rhs, right) else np.zeros_like(right)
        lift(
            data.coefficients, data.axes, data.own_sets, data.lifted, data.offset, 0,
            data.lifted.shape[1], added,
        )  # fmt: skip
        if added is not right:
            rhs += unflat(added)

    @property
    def lift_seconds(self) -> float:
        """Time of the reconstruction so far."""
        return float(self._lift.seconds.sum())

    @lift_seconds.setter
    def lift_seconds(self, seconds: float) -> None:
        self._lift.seconds[:] = seconds


def _lift(group: ConstraintGroup, reduction: Reduction) -> Lift:
    mean, blocks, r = reduction.basis.mean, reduction.blocks, reduction.r
    operator = group.S.T.multiply(group.row_weights[None, :]).tocsr()
    vertices = operator.shape[0]
    place = _local_positions(reduction)
    every = [range(3) if block.axis is None else (block.axis,) for block in blocks]
    columns = [(axis, k) for k, axes in enumerate(every) for axis in axes]
    lifted = np.zeros((len(columns), vertices, r))
    for own, (axis, _) in zip(lifted, columns, strict=True):
        own[...] = operator @ reduction.v[axis::3]
    return Lift(
        starts=np.cumsum([0, *(len(block.entries) for block in blocks)], dtype=np.int64),
        positions=_joined([place(block.entries) for block in blocks], np.int64),
        packed=np.empty(sum(len(block.entries) for block in blocks)),
        operators=_joined([block.operator.ravel() for block in blocks], np.float64),
        shifts=np.array([b.operator @ mean[b.entries] for b in blocks]).reshape(-1, r),
        coefficients=np.zeros((len(blocks), r)),
        axes=np.array([axis for axis, _ in columns], dtype=np.int64),
        own_sets=np.array([k for _, k in columns], dtype=np.int64),
        lifted=lifted,
        offset=flat(as_vertices(operator @ mean.reshape(-1, 3))),
        seconds=np.zeros(2),
    )


def _joined(parts: list[np.ndarray], kind: type) -> np.ndarray:
    return np.concatenate([np.empty(0, kind), *parts]).astype(kind)


def _local_positions(reduction: Reduction) -> Callable[[np.ndarray], np.ndarray]:
    """Map from entries of the full vector to entries of the sampled elements' vector."""
    size = 3 * reduction.basis.rows_per_element
    order = np.argsort(reduction.elements, kind="stable")
    ordered = reduction.elements[order]

    def place(entries: np.ndarray) -> np.ndarray:
        element, inside = np.divmod(entries, size)
        return size * order[np.searchsorted(ordered, element)] + inside

    return place
