"""Interpolated projections in the coordinates of a position subspace.

A few elements are evaluated, their values give coefficients c, and the coefficients give the
right-hand side B^T S^T W (mean + V c). All that has the length of the mesh is multiplied out
beforehand; the system matrix stays that of the full projections.
"""

from dataclasses import dataclass

import numpy as np

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.subspace.columns import Columns

_ARRAYS = (
    "elements", "operator", "modes", "offset", "stiffness", "lower", "upper",
    "control", "control_factors",
)  # fmt: skip


@dataclass(frozen=True)
class Interpolation:
    """Arrays that one group needs online, in a subspace of K coordinates.

    elements : (m,) sampled elements, ascending; none where the projections are constant
    operator : (r, n) from sampled values to coefficients; n is m p where the axes share one
        operator (coefficients (r, 3)) and 3 m p where they share the coefficients (r, 1)
    modes : (K, r) or (3 K, r), B^T S^T W V
    offset : (K, 3) what is added whatever the coefficients
    stiffness : (K, K) B^T S^T W S B of all elements
    gain : || operator ||_2
    residual : whether p - S y is interpolated, instead of p
    lower, upper : (r, 1) bounds of the coefficients, or None
    control, control_factors : (m',) sampled elements of the safeguard and their factors, or None
    """

    elements: np.ndarray
    operator: np.ndarray
    modes: np.ndarray
    offset: np.ndarray
    stiffness: np.ndarray
    gain: float
    residual: bool = False
    lower: np.ndarray | None = None
    upper: np.ndarray | None = None
    control: np.ndarray | None = None
    control_factors: np.ndarray | None = None

    @classmethod
    def of_constant(cls, stiffness: np.ndarray, offset: np.ndarray) -> "Interpolation":
        """Interpolation of projections that are constant up to round-off: it samples no element.

        Parameters
        ----------
        stiffness : (K, K) B^T S^T W S B
        offset : (K, 3) B^T S^T W p
        """
        none = np.empty(0, dtype=np.int64)
        empty = np.empty((len(stiffness), 0))
        return cls(none, np.empty((0, 0)), empty, offset, stiffness, gain=1.0)

    def save(self, store) -> None:
        """Write into the HDF5 group ``store``."""
        store.attrs["gain"], store.attrs["residual"] = self.gain, self.residual
        for name in _ARRAYS:
            if getattr(self, name) is not None:
                store[name] = getattr(self, name)

    @classmethod
    def load(cls, store) -> "Interpolation":
        """Read what `save` wrote into the HDF5 group ``store``."""
        arrays = {name: store[name][...] for name in _ARRAYS if name in store}
        return cls(
            **arrays, gain=float(store.attrs["gain"]), residual=bool(store.attrs["residual"])
        )


class InterpolatedLocalStep:
    """The local step of a group whose projections are interpolated."""

    def __init__(
        self, group: ConstraintGroup, columns: Columns, interpolation: Interpolation
    ) -> None:
        self.name = group.name
        self.matrix = interpolation.stiffness
        self._interpolation = interpolation
        self._elements = np.arange(len(interpolation.elements))
        if len(self._elements) == 0:
            return
        factors = np.ones(len(self._elements))
        self.group, vertices = group.restricted(interpolation.elements, factors)
        self._rows = np.ascontiguousarray(columns.B[vertices])
        self._strain = self.group.S @ self._rows

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze frame-lagged data of the sampled elements at the coordinates q (K, 3)."""
        if len(self._elements):
            self.group.begin_frame(self._rows @ q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add B^T S^T W p at ``y`` (K, 3) to ``rhs`` (K, 3); the energy is unknown: nan."""
        i = self._interpolation
        rhs += i.offset
        if len(self._elements) == 0:
            return float("nan")
        values = self.group.project_elements(self._rows @ y, self._elements)
        if i.residual:
            values -= self._strain @ y
            rhs += i.stiffness @ y
        coefficients = i.operator @ values.reshape(i.operator.shape[1], -1)
        if i.lower is not None:
            np.clip(coefficients, i.lower, i.upper, out=coefficients)
        rhs += (i.modes @ coefficients).reshape(rhs.shape)
        return float("nan")


def reduced_strain(group: ConstraintGroup, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
    """S B (e p, K) and the stiffness B^T S^T W S B (K, K) of ``group`` in ``columns``."""
    strain = group.S @ columns.B
    return strain, strain.T @ (group.row_weights[:, None] * strain)


def element_rows(elements: np.ndarray, size: int) -> np.ndarray:
    """Rows (m size,) of ``elements`` (m,) with ``size`` rows each, in the order of the elements."""
    return (elements[:, None] * size + np.arange(size)).ravel()
