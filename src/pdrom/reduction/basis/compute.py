"""Snapshots -> basis, ingredient by ingredient."""

import numpy as np
from scipy import linalg

from pdrom.core.errors import SnapshotError
from pdrom.core.store import require_finite
from pdrom.reduction.basis.pod import fix_signs, numerical_rank, pod
from pdrom.reduction.basis.types import Basis
from pdrom.reduction.method import BasisSpec
from pdrom.reduction.snapshots import SnapshotSet


def compute_basis(
    snapshots: np.ndarray,
    row_mass: np.ndarray,
    roundoff: float,
    rows_per_element: int,
    spec: BasisSpec,
    signs: np.random.Generator | None = None,
) -> Basis:
    """Basis of training snapshots.

    Parameters
    ----------
    snapshots : (n, e p, 3) projections
    row_mass : (e p,) kg, used by mass weighting
    roundoff : Frobenius norm of the rounding errors in ``snapshots``
    rows_per_element : p
    signs : flips the modes at random before "mean-in-modes" adds the mean to them; there the span
        depends on these arbitrary signs
    spec : weighting, centring and layout

    Raises
    ------
    SnapshotError
        Fewer than two snapshots, a wrong shape, NaN or Inf, a row without mass where it weighs.
    """
    _check(snapshots, row_mass, rows_per_element, spec)
    matrix = snapshots.reshape(len(snapshots), -1).T
    scale = _row_scale(row_mass, spec)
    mean = _offset(matrix, spec)
    centred = (matrix - mean[:, None]) * scale[:, None]
    error = max(roundoff, _mean_error(matrix, spec))
    noise = error * float(scale.max())
    # a constant axis is in the mean already; "mean-in-modes" puts it back into the modes
    shown = matrix - mean[:, None] if spec.centring == "affine" else matrix
    active = _active_axes(shown, error)
    if spec.layout == "per-axis":
        modes, sigma, ranks = _per_axis(centred, noise)
        active = tuple(a and own > 0 for a, own in zip(active, ranks, strict=True))
        rank = max(ranks)
    else:
        modes, sigma = pod(centred)
        rank = numerical_rank(sigma, centred.shape, noise)
    if not any(active):
        rank = 0
    if spec.centring == "mean-in-modes":
        # orthonormal axis by axis: no more modes than rows
        rank = min(rank, len(row_mass))
    v = modes[:, :rank]
    if spec.centring == "mean-in-modes":
        v = _mean_in_modes(v, centred, mean * scale, active, signs)
        mean = np.zeros_like(mean)
    return Basis(
        V=np.ascontiguousarray(v / scale[:, None]),
        mean=mean,
        singular_values=sigma,
        rank=rank,
        roundoff=noise,
        rows_per_element=rows_per_element,
        separate_axes=spec.layout == "per-axis" or spec.centring == "mean-in-modes",
        active_axes=active,
    )


def basis_of(
    data: SnapshotSet,
    spec: BasisSpec,
    train: np.ndarray | None = None,
    signs: np.random.Generator | None = None,
) -> Basis:
    """Basis ``spec`` of the training snapshots of ``data``; ``signs`` and errors: `compute_basis`.

    ``train`` (n, e p, 3) takes their place.
    """
    return compute_basis(
        data.train if train is None else train,
        data.row_mass,
        data.roundoff,
        rows_per_element=data.rows_per_element,
        spec=spec,
        signs=signs,
    )


def _check(
    snapshots: np.ndarray, row_mass: np.ndarray, rows_per_element: int, spec: BasisSpec
) -> None:
    if snapshots.ndim != 3 or snapshots.shape[2] != 3 or len(snapshots) < 2:
        raise SnapshotError(f"snapshots of shape {snapshots.shape}, required: (n >= 2, e p, 3)")
    rows = snapshots.shape[1]
    if rows == 0 or rows % rows_per_element:
        raise SnapshotError(
            f"snapshots of {rows} rows, required: a multiple of rows_per_element "
            f"= {rows_per_element}"
        )
    if row_mass.shape != (rows,):
        raise SnapshotError(f"row_mass of shape {row_mass.shape}, required: ({rows},)")
    require_finite("snapshots", snapshots, SnapshotError)
    if spec.weighting == "mass":
        require_finite("row_mass", row_mass, SnapshotError)
        if row_mass.min() <= 0.0:
            row = int(np.argmin(row_mass))
            raise SnapshotError(f"row_mass: row {row} has {row_mass[row]} kg, required: above 0")


def _row_scale(row_mass: np.ndarray, spec: BasisSpec) -> np.ndarray:
    """Square root of the inner product's diagonal, (3 e p,)."""
    if spec.weighting == "none":
        return np.ones(3 * len(row_mass))
    return np.repeat(np.sqrt(row_mass), 3)


def _offset(matrix: np.ndarray, spec: BasisSpec) -> np.ndarray:
    """Vector (3 e p,) that is subtracted from every snapshot."""
    if spec.centring == "affine":
        return matrix.mean(axis=1)
    if spec.centring == "mean-in-modes":
        return matrix[:, 0].copy()
    return np.zeros(len(matrix))


def _mean_error(matrix: np.ndarray, spec: BasisSpec) -> float:
    """Bound on what a computed mean leaves in the centred matrix, as a Frobenius norm.

    A sum of n terms is wrong by at most n eps/2 times the sum of their magnitudes (Higham 2002,
    section 4.2), the same in every column. Without this bound constant snapshots, whose centred
    matrix is that error and nothing else, would get a basis made of it. Subtracting the first
    snapshot makes no such error.
    """
    if spec.centring != "affine":
        return 0.0
    return 0.5 * np.finfo(float).eps * matrix.shape[1] * float(np.linalg.norm(matrix))


def _active_axes(matrix: np.ndarray, roundoff: float) -> tuple[bool, ...]:
    """Axes that hold more than round-off (of the data, or relative to the largest axis)."""
    norms = np.array([np.linalg.norm(matrix[axis::3]) for axis in range(3)])
    relative = max(matrix.shape) * np.finfo(float).eps * norms.max()
    return tuple(bool(norm > max(roundoff, relative)) for norm in norms)


def _per_axis(centred: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """One basis per axis, stored side by side, and their ranks; zero modes beyond an axis's rank.

    The k-th singular value is the norm of the three axes' k-th ones.
    """
    n, m = centred.shape
    modes = np.zeros((n, min(n // 3, m)))
    sigma = np.zeros((3, min(n // 3, m)))
    ranks = []
    for axis in range(3):
        u, sigma[axis] = pod(centred[axis::3])
        own = numerical_rank(sigma[axis], centred[axis::3].shape, noise)
        modes[axis::3, :own] = u[:, :own]
        ranks.append(own)
    return modes, np.linalg.norm(sigma, axis=0), ranks


def _mean_in_modes(
    v: np.ndarray,
    centred: np.ndarray,
    first: np.ndarray,
    active: tuple[bool, ...],
    signs: np.random.Generator | None,
) -> np.ndarray:
    """The published code's modes: rescaled, first snapshot added to each, QR axis by axis.

    As there, an axis that holds fewer independent columns than modes gets the completion that the
    Householder vectors happen to give: orthonormal, but not from data.
    """
    if v.shape[1] == 0:
        return v
    if signs is not None:
        v = v * signs.choice([-1.0, 1.0], size=v.shape[1])
    shifted = v * np.std(centred) + first[:, None]
    result = np.zeros_like(shifted)
    for axis in np.flatnonzero(active):
        q = linalg.qr(shifted[axis::3], mode="economic")[0]
        result[axis::3] = fix_signs(q)
    return result
