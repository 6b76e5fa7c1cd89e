"""POD bases computed from snapshots of projections: weighting, centring, signs, numerical rank."""

import os
from dataclasses import dataclass, replace

import h5py
import numpy as np
from scipy import linalg

from pdrom.core.errors import RankError, SnapshotError
from pdrom.core.packed import brief
from pdrom.core.store import open_hdf5, require_finite, write_hdf5
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.reduction.method import BasisSpec
from pdrom.reduction.snapshots import SnapshotSet, row_masses

# Snapshots whose largest entry is below this limit or above its inverse are scaled, since squares
# of their entries could underflow or overflow.
SMALL = 1e-100


@dataclass(frozen=True, eq=False)
class Basis:
    """POD basis of a constraint group: affine space mean + span V of vectorised projections.

    The group has e elements with p rows of three numbers (x, y, z) each. Entry i of a vector is
    axis i % 3 of row i // 3, which belongs to element i // (3 p).

    V : (3 e p, rank); orthonormal (with mass weighting in the inner product of the row masses), or
        orthonormal axis by axis if the recipe has `BasisSpec.separate_axes`
    mean : (3 e p,), zero unless the snapshots are centred
    """

    V: np.ndarray
    mean: np.ndarray
    singular_values: np.ndarray  # all of the matrix of weighted, centred training snapshots
    rank: int  # number of singular values above rounding errors: columns of V
    roundoff: float  # singular values up to this absolute size are noise
    rows_per_element: int
    active_axes: tuple[bool, ...]  # for x, y, z: whether snapshots exceed rounding errors
    origin: str = "basis"  # name in error messages: the path of its file

    __repr__ = brief

    @property
    def elements(self) -> int:
        """Number of elements e."""
        return len(self.mean) // (3 * self.rows_per_element)

    def truncated(self, r: int) -> np.ndarray:
        """Return the first r modes (3 e p, r); RankError if the basis has fewer modes."""
        if not 1 <= r <= self.rank:
            allowed = f"allowed are 1 to {self.rank}" if self.rank else "there is nothing to reduce"
            raise RankError(
                f"{self.origin}: r = {r}, the snapshots have numerical rank {self.rank} "
                f"(rounding errors {self.roundoff:.1e}): {allowed}"
            )
        return self.V[:, :r]


_ARRAYS = ("V", "mean", "singular_values")
_ATTRIBUTES = ("rank", "roundoff", "rows_per_element", "active_axes")


def save_basis(basis: Basis, path: str | os.PathLike[str]) -> None:
    """Write ``basis`` to the HDF5 file ``path``."""
    with write_hdf5(path) as file:
        store_basis(basis, file)


def store_basis(basis: Basis, file: h5py.Group) -> None:
    """Write ``basis`` to the open HDF5 group ``file``."""
    for name in _ARRAYS:
        file[name] = getattr(basis, name)
    for name in _ATTRIBUTES:
        file.attrs[name] = getattr(basis, name)


def load_basis(path: str | os.PathLike[str]) -> Basis:
    """Read the basis file ``path`` that `save_basis` wrote; StorageError if it is damaged."""
    with open_hdf5(path) as file:
        return stored_basis(file, str(path))


def stored_basis(file: h5py.Group, origin: str) -> Basis:
    """Read the basis that `store_basis` wrote to the HDF5 group ``file``, named ``origin``."""
    return Basis(
        **{name: file[name][...] for name in _ARRAYS},
        rank=int(file.attrs["rank"]),
        roundoff=float(file.attrs["roundoff"]),
        rows_per_element=int(file.attrs["rows_per_element"]),
        active_axes=tuple(bool(a) for a in file.attrs["active_axes"]),
        origin=origin,
    )


def compute_basis(
    snapshots: np.ndarray, row_mass: np.ndarray, roundoff: float, rows_per_element: int,
    spec: BasisSpec, signs: np.random.Generator | None = None,
) -> Basis:  # fmt: skip
    """Compute the POD basis of training snapshots.

    Raises SnapshotError for fewer than two snapshots, a wrong shape, NaN or Inf, or mass weighting
    with a zero mass.

    snapshots : (n, e p, 3) projections of e elements with p rows each
    row_mass : (e p,) kg, used by mass weighting
    roundoff : Frobenius norm of the rounding errors in ``snapshots``
    signs : generator that draws the sign of each mode; None keeps all signs. Signs matter only with
        centring "mean-in-modes", which adds the first snapshot to every mode.
    """
    _check(snapshots, row_mass, rows_per_element, spec)
    require_finite("rounding errors of snapshots", np.array([roundoff]), SnapshotError)
    largest = float(np.abs(snapshots).max())
    if largest > 0.0 and not SMALL <= largest <= 1.0 / SMALL:
        unit = 2.0 ** (np.frexp(largest)[1] - 1)  # a power of two, so that scaling is exact
        scaled = snapshots / unit, row_mass, roundoff / unit
        made = compute_basis(*scaled, rows_per_element, spec, signs)
        with np.errstate(over="ignore"):
            sigma = require_finite("singular values", made.singular_values * unit, SnapshotError)
        noise = float(made.roundoff * unit)
        return replace(made, mean=made.mean * unit, singular_values=sigma, roundoff=noise)
    matrix = snapshots.reshape(len(snapshots), -1).T
    scale = np.ones(3 * len(row_mass))  # square roots of the masses for mass weighting, else 1
    if spec.weighting == "mass":
        scale = np.repeat(np.sqrt(row_mass), 3)
    mean, error, shown = np.zeros(len(matrix)), roundoff, matrix
    if spec.centring == "affine":
        # The mean of n snapshots has a rounding error of at most n eps/2 times the mean of their
        # magnitudes (Higham 2002, section 4.2), and so has every centred snapshot. Without this
        # bound of its norm over all n, constant snapshots would get spurious modes.
        rounded = 0.5 * np.finfo(float).eps * matrix.shape[1] * float(np.linalg.norm(matrix))
        mean, error = matrix.mean(axis=1), max(roundoff, rounded)
        # with this centring an axis (x, y, z) with constant snapshots counts as inactive, see below
        shown = matrix - mean[:, None]
    elif spec.centring == "mean-in-modes":
        mean = matrix[:, 0].copy()
    centred = (matrix - mean[:, None]) * scale[:, None]
    noise = error * float(scale.max())
    # an axis is active if the norm of its snapshots exceeds the rounding errors of the data and
    # those of an SVD, which are relative to the largest of the three norms
    norms = np.array([np.linalg.norm(shown[axis::3]) for axis in range(3)])
    least = max(error, max(shown.shape) * np.finfo(float).eps * norms.max())
    active = tuple(bool(norm > least) for norm in norms)
    if spec.layout == "per-axis":
        modes, sigma, ranks = _per_axis(centred, noise)
        active = tuple(a and own > 0 for a, own in zip(active, ranks, strict=True))
        rank = max(ranks)
    else:
        modes, sigma = pod(centred)
        rank = numerical_rank(sigma, centred.shape, noise)
    v = modes[:, : rank if any(active) else 0]
    if spec.centring == "mean-in-modes":
        # on one axis, no more modes can be orthonormal than the axis has rows
        v = _mean_in_modes(v[:, : len(row_mass)], centred, mean * scale, active, signs)
        mean = np.zeros_like(mean)
    modes, p = np.ascontiguousarray(v / scale[:, None]), rows_per_element
    return Basis(modes, mean, sigma, v.shape[1], noise, p, active)


def basis_of(
    data: SnapshotSet, spec: BasisSpec, train: np.ndarray | None = None,
    signs: np.random.Generator | None = None,
) -> Basis:  # fmt: skip
    """Compute the POD basis of the training snapshots of ``data``, or of ``train`` (n, e p, 3)."""
    snapshots, p = data.train if train is None else train, data.rows_per_element
    return compute_basis(snapshots, data.row_mass, data.roundoff, p, spec, signs)


def group_basis(
    group: ConstraintGroup, masses: np.ndarray, p: np.ndarray, roundoff: float, spec: BasisSpec
) -> Basis:
    """Compute the POD basis of snapshots ``p`` of ``group``, with vertex ``masses`` (N,) kg."""
    return compute_basis(p, row_masses(group, masses), roundoff, group.rows_per_element, spec)


def _check(
    snapshots: np.ndarray, row_mass: np.ndarray, rows_per_element: int, spec: BasisSpec
) -> None:
    n, rows, axes = snapshots.shape if snapshots.ndim == 3 else (0, 0, 0)
    if n < 2 or axes != 3 or rows == 0 or rows % rows_per_element:
        required = f"(n >= 2, e p, 3), p = {rows_per_element}; one or two frames have one snapshot"
        raise SnapshotError(f"snapshots of shape {snapshots.shape}, required: {required}")
    if row_mass.shape != (rows,):
        raise SnapshotError(f"row_mass of shape {row_mass.shape}, required: ({rows},)")
    require_finite("snapshots", snapshots, SnapshotError)
    if spec.weighting == "mass":
        require_finite("row_mass", row_mass, SnapshotError)
        if row_mass.min() <= 0.0:
            row = int(np.argmin(row_mass))
            raise SnapshotError(f"row_mass: row {row} has {row_mass[row]} kg, required: above 0")


def _per_axis(centred: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Return one POD basis per axis as (modes, singular values, rank of each axis).

    Modes of an axis beyond its rank are zero. The returned singular value k is the 2-norm of the
    k-th ones of the three axes.
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
    v: np.ndarray, centred: np.ndarray, first: np.ndarray, active: tuple[bool, ...],
    signs: np.random.Generator | None,
) -> np.ndarray:  # fmt: skip
    """Scale modes ``v``, add the snapshot ``first`` to each, and orthonormalise per axis by QR.

    The scale is the standard deviation of all entries of ``centred``. As in the program published
    with the preprint, an axis with fewer independent columns than modes is completed by Householder
    vectors, which do not come from the data.
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


def pod(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute min(n, m) left singular vectors and singular values of ``matrix`` (n, m).

    A tall matrix is first reduced by a QR factorisation (Chan 1982), which is backward stable,
    unlike the eigenvalues of A^T A. Each vector's entry of largest magnitude is positive.
    """
    if matrix.shape[0] > matrix.shape[1]:
        q, second, r = thin_qr(matrix)
        u, sigma, _ = linalg.svd(r, full_matrices=False, check_finite=False)
        u = (linalg.solve_triangular(second, u, check_finite=False).T @ q.T).T
    else:
        u, sigma, _ = linalg.svd(matrix, full_matrices=False, check_finite=False)
    return fix_signs(u), sigma


def fix_signs(u: np.ndarray) -> np.ndarray:
    """Return ``u`` (n, m) with the sign of each column changed so that its largest entry is > 0.

    Magnitudes are rounded to single precision before they are compared. Of several entries that are
    equal up to rounding errors, the first thus decides.
    """
    largest = [np.argmax(np.abs(mode).astype(np.float32)) for mode in u.T]
    signs = np.sign(u[largest, np.arange(u.shape[1])])
    return u * np.where(signs == 0.0, 1.0, signs)


# `thin_qr` accepts its factor Q_1 as orthonormal if |Q_1^T Q_1 - I| is at most this. Rounding
# errors give 1e-14 to 1e-13; if its matrix L has the condition number 1e2, it is about 1e-12.
DEPARTURE = 1e-12


def thin_qr(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Factor A = ``matrix`` (n, m), n > m, as (Q_1 R_2^-1) R; return Q_1, R_2 (m, m), R (m, m).

    Q_1 R_2^-1 has orthonormal columns, also where A has no full rank. The product
    is not formed: a caller needs Q_1 R_2^-1 C with a small matrix C, and R_2^-1 C costs less.

    Householder reflections read A once per column and wait for memory. Here (Terao, Ozaki and
    Ogita 2020) LU with partial pivoting, A = P L U, leaves a well-conditioned L, and two Cholesky
    factorisations of Gram matrices make it orthonormal: P L = Q_1 R_1, Q_1 = Q R_2, R = R_2 R_1 U,
    with an error of about eps cond(L) in each column. Reflections factor A if L is ill-conditioned,
    so that Q_1 is not orthonormal up to `DEPARTURE`.
    """
    lower, swaps, _ = linalg.lapack.dgetrf(np.array(matrix, order="F"), overwrite_a=True)
    m = matrix.shape[1]
    upper = np.triu(lower[:m])
    lower[:m] = np.tril(lower[:m], -1) + np.eye(m)
    try:
        first = linalg.cholesky(lower.T @ lower, check_finite=False)
    except linalg.LinAlgError:
        return _by_reflections(matrix)
    q = linalg.blas.dtrsm(1.0, first, lower, side=1, overwrite_b=True)
    gram = q.T @ q
    if not np.abs(gram - np.eye(m)).max() <= DEPARTURE:
        return _by_reflections(matrix)
    second = linalg.cholesky(gram, check_finite=False)
    for k in reversed(range(m)):
        q[[k, swaps[k]]] = q[[swaps[k], k]]
    return q, second, second @ (first @ upper)


def _by_reflections(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, r = linalg.qr(matrix, mode="economic", check_finite=False)
    return q, np.eye(len(r)), r


def numerical_rank(singular_values: np.ndarray, shape: tuple[int, int], roundoff: float) -> int:
    """Count ``singular_values`` (n,) of a matrix of ``shape`` that exceed two error levels.

    The relative level max(shape) eps sigma_1 is the backward error of the SVD; the absolute level
    ``roundoff`` is the error of the data, which may be differences of cancelling terms.
    """
    if len(singular_values) == 0:
        return 0
    relative = max(shape) * np.finfo(float).eps * singular_values[0]
    return int(np.count_nonzero(singular_values > max(relative, roundoff)))
