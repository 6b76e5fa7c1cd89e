"""Reduced projections: p(q) is replaced by mean + V c; c is computed from sampled entries of p."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

from pdrom.core.errors import SamplingError
from pdrom.reduction.basis import Basis
from pdrom.reduction.method import SELECTIONS, MethodSpec, Solve
from pdrom.reduction.sampling.deim import Selection, joint_rows
from pdrom.reduction.sampling.gappy_pod_e import oversample


def solution_operator(a: np.ndarray, solve: Solve, tikhonov: float) -> np.ndarray:
    """Compute the matrix (r, m) that maps samples b (m,) to coefficients c with A c = b, A = ``a``.

    square : A^-1; nan, so that a run blows up, if A is singular to working precision or not square
    qr : least squares A^+ by a QR factorisation; nan if A has not full column rank
    tikhonov : (A^T A + t I)^-1 A^T with t = ``tikhonov``, as in the preprint authors' program
    """
    if solve == "tikhonov":
        gram = a.T @ a + tikhonov * np.eye(a.shape[1])
        return linalg.solve(gram, a.T, assume_a="pos", check_finite=False)
    if solve == "square":
        if a.shape[0] != a.shape[1]:
            return np.full(a.shape[::-1], np.nan)
        lu, pivots, info = linalg.lapack.dgetrf(a)
        if info > 0 or _singular(np.abs(np.diag(lu))):
            return np.full(a.shape, np.nan)
        return linalg.lu_solve((lu, pivots), np.eye(len(a)), check_finite=False)
    q, r = linalg.qr(a, mode="economic", check_finite=False)
    if a.shape[0] < a.shape[1] or _singular(np.abs(np.diag(r))):
        return np.full((a.shape[1], a.shape[0]), np.nan)
    return linalg.solve_triangular(r, q.T, check_finite=False)


def _singular(diagonal: np.ndarray) -> bool:
    """Whether the least entry of the ``diagonal`` of a triangular factor is a rounding error."""
    return bool(diagonal.min() <= np.finfo(float).eps * diagonal.max())


def norm_and_condition(a: np.ndarray, operator: np.ndarray) -> tuple[float, float]:
    """Compute the 2-norm of ``operator`` and the condition of ``a`` (m, r); inf if singular."""
    if not np.isfinite(operator).all():
        return np.inf, np.inf
    sigma = linalg.svdvals(a, check_finite=False)
    condition = float(sigma[0] / sigma[-1]) if sigma[-1] > 0.0 else np.inf
    return float(linalg.svdvals(operator, check_finite=False)[0]), condition


@dataclass(frozen=True)
class Sampling:
    """Entries and elements of the projection that a method evaluates during a run.

    entries : indices into the vectorised projection (e elements of p rows x, y, z), in order of
        selection; in "joint" sampling the x entry of a row stands for all three entries of the row
    elements : unique indices of the elements of these entries, in the order of their first entries
    """

    entries: np.ndarray
    elements: np.ndarray

    @classmethod
    def of_entries(
        cls, entries: np.ndarray, rows_per_element: int, elements: int, repeats: bool = False
    ) -> "Sampling":
        """Sample ``entries`` (m,) of a vectorised projection of all ``elements``.

        SamplingError if an entry is out of range, or occurs twice without ``repeats``.
        """
        entries = np.asarray(entries, dtype=np.int64)
        size = 3 * rows_per_element
        if len(entries) == 0 or entries.min() < 0 or entries.max() >= size * elements:
            raise SamplingError(
                f"entries {entries[:5].tolist()}...: allowed are 0 to {size * elements - 1}"
            )
        if not repeats and len(np.unique(entries)) < len(entries):
            raise SamplingError(f"{len(entries)} entries, some of them repeated")
        touched = entries // size
        first = np.sort(np.unique(touched, return_index=True)[1])
        return cls(entries, touched[first])

    @classmethod
    def of_elements(cls, elements: np.ndarray, rows_per_element: int, total: int) -> "Sampling":
        """Sample all 3p entries of ``elements`` (m,) of ``total`` elements of p rows."""
        entries = element_rows(np.asarray(elements, dtype=np.int64), 3 * rows_per_element)
        return cls.of_entries(entries, rows_per_element, total)


def element_rows(elements: np.ndarray, size: int) -> np.ndarray:
    """Return indices (m size,) of all rows of ``elements`` (m,), of ``size`` rows each."""
    return (elements[:, None] * size + np.arange(size)).ravel()


@dataclass(frozen=True)
class Block:
    """One set of coefficients: shared by all axes (``axis`` None), or of a single axis."""

    axis: int | None
    entries: np.ndarray  # (m,) sampled entries that determine the coefficients
    matrix: np.ndarray  # (m, r) the basis at these entries
    operator: np.ndarray  # (r, m) matrix that maps sampled values to coefficients

    @property
    def output(self) -> slice:
        """Entries of the vectorised projection that these coefficients reconstruct."""
        return slice(None) if self.axis is None else slice(self.axis, None, 3)


class Reduction:
    """Approximation of a group's projections by r modes, from sampled entries or from all of them.

    An axis whose training data are rounding errors has zero coefficients and does not enter the
    DEIM constant `gain`. If the system of any other axis is singular, the method fails: `gain` is
    inf and the reconstruction nan.

    v : (3 e p, r) modes
    elements : elements to evaluate, in the order of ``sampling.elements``
    blocks : sets of coefficients, each with its sampled entries and its operator
    """

    def __init__(self, basis: Basis, sampling: Sampling, spec: MethodSpec, r: int) -> None:
        self.basis, self.sampling, self.spec, self.r = basis, sampling, spec, r
        self.v, self.elements = basis.truncated(r), sampling.elements
        axes = [int(a) for a in np.flatnonzero(basis.active_axes)] if spec.per_axis else [None]
        self.blocks = [self._block(axis) for axis in axes]

    def _block(self, axis: int | None) -> Block:
        if self.spec.rows == "all":
            entries = np.arange(len(self.v))[slice(None) if axis is None else slice(axis, None, 3)]
            matrix = self.v[entries]
            # the pseudo-inverse of orthonormal columns V is V^T
            gram = matrix.T @ matrix
            orthonormal = np.allclose(gram, np.eye(len(gram)), rtol=0.0, atol=1e-12)
            return Block(axis, entries, matrix, matrix.T if orthonormal else np.linalg.pinv(matrix))
        entries = self.sampling.entries
        if self.spec.rows == "joint":  # each index stands for x, y and z of its row
            axes = np.arange(3) if axis is None else np.array([axis])
            entries = (3 * (entries // 3)[:, None] + axes).ravel()
        elif axis is not None:
            entries = entries[entries % 3 == axis]
        matrix = self.v[entries]
        operator = solution_operator(matrix, self.spec.solve, self.spec.tikhonov)
        return Block(axis, entries, matrix, operator)

    @cached_property
    def _norms(self) -> tuple[float, float]:
        if self.spec.rows == "all":
            return 1.0, 1.0
        pairs = [norm_and_condition(b.matrix, b.operator) for b in self.blocks]
        return max(g for g, _ in pairs), max(c for _, c in pairs)

    @property
    def gain(self) -> float:
        """DEIM constant || (P^T V)^+ ||_2 with the sampled rows P^T V; inf if these are singular.

        With several sets of coefficients it is the largest. For orthonormal V and distinct rows the
        reconstruction p^ of p satisfies || p - p^ || <= gain || (I - V V^T)(p - mean) ||
        (Chaturantabut and Sorensen 2010, lemma 3.2), also for separate axes. The Tikhonov solution
        is no projection: the factor in the bound is sqrt(1 + gain^2), and a bias is added. For rows
        taken up to m times the factor is sqrt(m) gain. With mass weighting, in the norm of the
        masses, it is || (P^T V)^+ P^T M^(-1/2) ||_2, but `gain` has no weights.
        """
        return self._norms[0]

    @property
    def condition(self) -> float:
        """Condition number of sampled rows P^T V; the largest of separate coefficients."""
        return self._norms[1]

    @property
    def rows_sampled(self) -> int:
        """Number of distinct rows (x, y, z) of the projections with at least one sampled entry."""
        return len(np.unique(self.sampling.entries // 3))

    def reconstruct(self, snapshots: np.ndarray) -> np.ndarray:
        """Reconstruct ``snapshots`` (n, e p, 3) from samples; nan if these do not suffice."""
        matrix = snapshots.reshape(len(snapshots), -1)
        result = np.tile(self.basis.mean, (len(matrix), 1))
        for block in self.blocks:
            sampled = matrix[:, block.entries] - self.basis.mean[block.entries]
            result[:, block.output] += sampled @ block.operator.T @ self.v[block.output].T
        return result.reshape(snapshots.shape)


def select(basis: Basis, spec: MethodSpec, r: int) -> Sampling:
    """Select samples by the method ``spec`` for the first r modes of ``basis``."""
    return select_path(basis, spec, [r])[r]


def select_path(basis: Basis, spec: MethodSpec, ranks: Sequence[int]) -> dict[int, Sampling]:
    """Select samples of ``basis`` by the method ``spec`` for each number r of modes in ``ranks``.

    RankError if an r is below 1 or exceeds the numerical rank of the basis.
    """
    if not ranks:
        return {}
    basis.truncated(min(ranks))
    v, counts = basis.truncated(max(ranks)), (basis.rows_per_element, basis.elements)
    if spec.rows == "all":
        everything = Sampling.of_elements(np.arange(basis.elements), *counts)
        return dict.fromkeys(ranks, everything)
    size = {"scalar": 1, "joint": 3, "element": 3 * basis.rows_per_element}[spec.rows]
    if spec.rows == "joint":
        path = joint_rows(v, basis.active_axes, spec.repeat_rows)
        starts = {r: path[:r] for r in ranks}
    else:
        selection: Selection = SELECTIONS.load(spec.selection)()
        starts = selection.one_a_mode(v, size, ranks)
    samplings = {}
    for r, chosen in starts.items():
        if spec.oversampling > 1:
            count = min(spec.oversampling * r, len(v) // size)
            selection = SELECTIONS.load(spec.selection)()
            chosen = selection.extend(v[:, :r], size, chosen, count)
        if spec.gain_bound is not None:
            chosen = oversample(v[:, :r], size, chosen, bound=spec.gain_bound)
        if spec.rows == "element":
            samplings[r] = Sampling.of_elements(chosen, *counts)
        else:
            # the x entry of each row stands for the row
            entries = 3 * chosen if spec.rows == "joint" else chosen
            samplings[r] = Sampling.of_entries(entries, *counts, repeats=spec.repeat_rows)
    return samplings


def reductions(basis: Basis, spec: MethodSpec, sizes: Sequence[int]) -> dict[int, Reduction]:
    """Map r -> reduction by ``spec`` for r of ``sizes``; r above the basis's rank are left out."""
    known = [r for r in sizes if r <= basis.rank]
    path = select_path(basis, spec, known)
    return {r: Reduction(basis, path[r], spec, r=r) for r in known}
