"""Reconstruction errors of training snapshots, from this study's `published` to that code's own."""

from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from pdrom.reduction.basis.pod import fix_signs
from pdrom.reduction.sampling.deim import TIE
from pdrom.reduction.sampling.joint import joint_rows
from pdrom.reduction.sampling.solve import solution_operator
from pdrom.reduction.snapshots import training_frames
from study.experiments.published_choices.choices import Choice, Variant

TIKHONOV = 1e-8  # of the method `published`
# An axis that moves less than this, beside the one that moves most, is at rest.
AT_REST = 1e-12


def training_snapshots(projections: np.ndarray, count: int, taken: Set[Choice]) -> np.ndarray:
    """``count`` of the projections (F, e p, 3): spread over the run, or every second one.

    The latter if the choice "frames" is ``taken``.
    """
    if "frames" in taken:
        return projections[: 2 * count : 2]
    return projections[training_frames(len(projections), count)]


def idle_axes(snapshots: np.ndarray) -> np.ndarray:
    """Whether x, y and z are at rest in all snapshots (n, e p, 3)."""
    norms = np.linalg.norm(snapshots, axis=(0, 1))
    return norms <= AT_REST * norms.max()


@dataclass(frozen=True)
class Decomposed:
    """Snapshots with the first one subtracted, and their singular vectors.

    snapshots : (n, e p, 3)
    weights : (e p,) square roots of the rows' weights
    first : (3 e p,) weighted first snapshot, x, y and z of a row one after the other
    scale : standard deviation of the weighted differences from it
    u : (3 e p, n) left singular vectors of the differences, all of them, with LAPACK's signs
    """

    snapshots: np.ndarray
    weights: np.ndarray
    first: np.ndarray
    scale: float
    u: np.ndarray


def decompose(snapshots: np.ndarray, row_sizes: np.ndarray, taken: Set[Choice]) -> Decomposed:
    """SVD of snapshots (n, e p, 3); rows weigh ``row_sizes`` (e p,) if "weighting" is ``taken``."""
    weights = np.sqrt(row_sizes) if "weighting" in taken else np.ones(len(row_sizes))
    weighted = (snapshots * weights[:, None]).reshape(len(snapshots), -1)
    first = weighted[0].copy()
    weighted -= first
    scale = float(np.std(weighted)) or 1.0
    u = linalg.svd((weighted / scale).T, full_matrices=False)[0]
    return Decomposed(snapshots, weights, first, scale, u)


def errors(
    data: Decomposed,
    rows_per_element: int,
    sizes: Sequence[int],
    variant: Variant,
) -> np.ndarray:
    """Relative errors (len(sizes), 3) of x, y and z at ``sizes`` of modes, ascending, n at most.

    They are nan for an axis at rest, and where normal equations are exactly singular. The rows of
    ``data`` are ``rows_per_element`` an element; ``variant`` says which choices are taken.
    """
    taken = variant.taken
    moving = ~idle_axes(data.snapshots)
    kept = tuple(bool(axis) for axis in moving | ("idle" in taken))
    basis = modes(data, kept, sizes[-1], "signs" in taken, variant.signs)
    picked = joint_rows(basis, kept, True, factors=_tie_factors(len(basis) // 3, variant.ties))
    # an element has several rows; the published code reads its number as that of a row
    rows = picked // rows_per_element if "rows" in taken else picked
    found = np.full((len(sizes), 3), np.nan)
    for axis in np.flatnonzero(moving):
        p = np.ascontiguousarray(data.snapshots[:, :, axis].T)
        v = np.asfortranarray(basis[axis::3])
        size = np.linalg.norm(p)
        for k, r in enumerate(sizes):
            c = _coefficients(v[rows[:r], :r], p[rows[:r]], "system" in taken)
            found[k, axis] = np.linalg.norm(v[:, :r] @ c - p) / size
    return found


def modes(
    data: Decomposed, axes: Sequence[bool], count: int, raw_signs: bool, seed: int | None
) -> np.ndarray:
    """The first ``count`` modes (3 e p, count) of ``data``, be they round-off or not.

    The first snapshot is added to every rescaled singular vector, then each of the ``axes`` is
    orthonormalised by itself, still weighted. A ``seed`` draws the signs of the singular vectors;
    ``raw_signs`` are those of LAPACK, otherwise they are fixed.
    """
    u = data.u[:, :count]
    if seed is not None:
        u = u * np.random.default_rng(seed).choice([-1.0, 1.0], size=count)
    elif not raw_signs:
        u = fix_signs(u)
    result = np.zeros((len(u), count))
    for axis in np.flatnonzero(axes):
        shifted = u[axis::3] * data.scale + data.first[axis::3, None]
        q = linalg.qr(shifted, mode="economic", check_finite=False)[0]
        result[axis::3] = q / data.weights[:, None]
    return result


def _tie_factors(rows: int, seed: int | None) -> np.ndarray | None:
    """Factors (rows,) that draw which of several rows with equal residuals is the largest."""
    return None if seed is None else 1.0 - TIE * np.random.default_rng(seed).random(rows)


def _coefficients(a: np.ndarray, b: np.ndarray, plain: bool) -> np.ndarray:
    """Solution of a c = b by normal equations; without the Tikhonov term they may be singular."""
    if not plain:
        return solution_operator(a, "tikhonov", TIKHONOV) @ b
    lu, pivots, info = linalg.lapack.dgetrf(a.T @ a)
    if info > 0:
        return np.full((a.shape[1], b.shape[1]), np.nan)
    return linalg.lu_solve((lu, pivots), a.T @ b, check_finite=False)
