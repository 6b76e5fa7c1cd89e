"""Columns B (N, K) of a position subspace q = B z with coordinates z (K, 3); x, y, z share B.

The free vertices have k modes and the affine columns 1, x, y, z of the rest shape, so that the
space contains the rest shape and every rigid motion. Vertices that a boundary condition fixes at
any time are divided into "atoms": sets that are fixed and released together. Each atom has separate
columns: affine ones and POD modes of its displacements after release. While an atom is fixed, its
coordinates are prescribed, so that pins and handles are exact; otherwise they are unknowns.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from pdrom.model.mesh.selection import farthest_points
from pdrom.reduction.basis import fix_signs, pod

# A column is dropped if its part orthogonal to the earlier ones has at most this share of its norm.
DEPENDENT = 1e-9
# Relative error of POD modes for the non-affine displacements of vertices fixed together.
OWN_MOTION = 1e-3
# Displacements below this fraction of the positions count as rounding errors.
ROUNDOFF = 100.0 * np.finfo(float).eps


@dataclass(frozen=True)
class Columns:
    """Columns of a position subspace."""

    B: np.ndarray  # (N, K) columns; those of the free vertices are mass-orthonormal
    free: np.ndarray  # indices of the columns of the free vertices
    atoms: list[np.ndarray]  # sets of vertices that boundary conditions fix and release together
    atom_columns: list[np.ndarray]  # for each atom, the indices of its columns
    modes: int  # number k of modes of the free vertices, without their columns 1, x, y, z


def affine_columns(points: np.ndarray) -> np.ndarray:
    """Return columns 1, x, y, z, (N, 4), of the rest shape ``points`` (N, 3) m."""
    return np.column_stack([np.ones(len(points)), points])


def displacement_modes(
    trajectory: np.ndarray, points: np.ndarray, masses: np.ndarray, k: int
) -> np.ndarray:
    """Compute k mass-weighted POD modes (N, k) of displacements minus their affine part.

    Each axis of each frame of ``trajectory`` (n, N, 3) is one snapshot (Monem et al. 2023). If the
    data have fewer modes, all are returned. ``points`` (N, 3) m is the rest shape, ``masses`` (N,)
    are in kg.
    """
    displacements = (trajectory - points).transpose(1, 0, 2).reshape(len(points), -1)
    weight = np.sqrt(masses)[:, None]
    affine = orthonormal(weight * affine_columns(points))
    rest = weight * displacements
    rest = rest - affine @ (affine.T @ rest)
    modes, sigma = pod(rest)
    # singular values up to ``noise`` are rounding errors, as are all those of affine displacements
    noise = ROUNDOFF * float(np.linalg.norm(weight[:, :, None] * trajectory.transpose(1, 0, 2)))
    useful = int(np.count_nonzero(sigma > max(DEPENDENT * sigma[0], noise)))
    return modes[:, : min(k, useful)] / weight


def build_columns(
    modes: np.ndarray,
    points: np.ndarray,
    masses: np.ndarray,
    atoms: Sequence[np.ndarray],
    trajectory: np.ndarray | None,
) -> Columns:
    """Build a subspace from ``modes`` (N, k) of the free vertices and columns of each atom.

    Each of ``atoms`` gets affine columns, and POD modes of its non-affine displacements in
    ``trajectory`` (n, N, 3) m, up to the error `OWN_MOTION`; if ``trajectory`` is None, its rows of
    ``modes``. ``points`` (N, 3) m is the rest shape, ``masses`` (N,) are in kg.
    """
    n = len(points)
    free_vertices = np.setdiff1d(np.arange(n), np.concatenate([np.empty(0, np.int64), *atoms]))
    weight = np.sqrt(masses[free_vertices])[:, None]
    raw = np.hstack([affine_columns(points), modes])[free_vertices]
    blocks = [(free_vertices, orthonormal(weight * raw) / weight)]
    blocks += [(a, _atom_columns(a, points, trajectory, modes)) for a in atoms]
    ends = np.cumsum([block.shape[1] for _, block in blocks])
    ranges = np.split(np.arange(ends[-1]), ends[:-1])
    b = np.zeros((n, ends[-1]))
    for (vertices, block), own in zip(blocks, ranges, strict=True):
        b[np.ix_(vertices, own)] = block
    count = modes.shape[1]
    if trajectory is None:  # given columns may depend on each other or be affine
        affine = orthonormal(weight * affine_columns(points)[free_vertices])
        count = len(ranges[0]) - affine.shape[1]
    return Columns(b, ranges[0], list(atoms), ranges[1:], count)


def _atom_columns(
    atom: np.ndarray, points: np.ndarray, trajectory: np.ndarray | None, modes: np.ndarray
) -> np.ndarray:
    if trajectory is None:
        return orthonormal(np.hstack([affine_columns(points), modes])[atom])
    affine = orthonormal(affine_columns(points[atom]))
    motion = (trajectory[:, atom] - points[atom]).transpose(1, 0, 2).reshape(len(atom), -1)
    rest = motion - affine @ (affine.T @ motion)
    own, sigma = pod(rest)
    scale = max(float(np.linalg.norm(motion)), np.finfo(float).eps * np.linalg.norm(points[atom]))
    found = int(np.count_nonzero(sigma > OWN_MOTION * scale))
    count = min(found, modes.shape[1], len(atom) - affine.shape[1])
    return np.hstack([affine, own[:, :count]])


def orthonormal(columns: np.ndarray) -> np.ndarray:
    """Orthonormalise ``columns`` (n, k) in their order; dependent columns are dropped."""
    kept: list[np.ndarray] = []
    for column in columns.T:
        norm = np.linalg.norm(column)
        rest = column.copy()
        for _ in range(2):  # the second pass removes errors of the first (Kahan and Parlett)
            for other in kept:
                rest -= other * (other @ rest)
        if norm > 0.0 and np.linalg.norm(rest) > DEPENDENT * norm:
            kept.append(rest / np.linalg.norm(rest))
    if not kept:
        return np.empty((len(columns), 0))
    return fix_signs(linalg.qr(np.stack(kept, axis=1), mode="economic")[0])


def atoms(units: Sequence[np.ndarray], vertices: int) -> list[np.ndarray]:
    """Divide all ``units``, sets that may overlap, into atoms: every unit is a union of atoms."""
    if not units:
        return []
    member = np.zeros((vertices, len(units)), dtype=bool)
    for column, unit in enumerate(units):
        member[unit, column] = True
    held = np.flatnonzero(member.any(axis=1))
    _, inverse = np.unique(member[held], axis=0, return_inverse=True)
    inverse = inverse.ravel()
    sets = [held[inverse == label] for label in range(inverse.max() + 1)]
    return sorted(sets, key=lambda s: int(s[0]))


def skinning_weights(points: np.ndarray, handles: int) -> np.ndarray:
    """Compute smooth weights (N, handles) >= 0 at ``points`` (N, 3) m, with sum 1 at each.

    Handles are vertices from farthest-point sampling, with Wendland's kernel
    (1 - d/R)^4 (4 d/R + 1) of the distance d <= R, divided by the sum of all kernels. R is three
    times (for one handle: twice) the largest distance of a vertex from its nearest handle.
    """
    chosen = farthest_points(points, np.arange(len(points)), handles)
    distance = np.linalg.norm(points[:, None, :] - points[chosen][None], axis=2)
    radius = 3.0 * distance.min(axis=1).max() if handles > 1 else 2.0 * distance.max()
    # R is 0 if every vertex is a handle; for a single vertex, all entries of distance are 0, too
    radius = max(radius, np.finfo(float).eps * distance.max(), np.finfo(float).tiny)
    scaled = np.minimum(distance / radius, 1.0)
    kernel = (1.0 - scaled) ** 4 * (4.0 * scaled + 1.0)
    return kernel / kernel.sum(axis=1, keepdims=True)


def skinning_modes(points: np.ndarray, masses: np.ndarray, k: int) -> np.ndarray:
    """Compute k mass-orthonormal columns (N, k) of span w_h [1, x, y, z], without affine part.

    w_h are the `skinning_weights` of handle h; there are as many handles as k columns require. Of
    more than k columns, those with the largest singular values are returned. ``points`` are
    (N, 3) m, ``masses`` (N,) kg.
    """
    weight = np.sqrt(masses)[:, None]
    fields = affine_columns(points - points.mean(axis=0))
    affine = orthonormal(weight * fields)
    handles = 2
    while True:
        weights = skinning_weights(points, handles)
        columns = weight * (weights[:, :, None] * fields[:, None, :]).reshape(len(points), -1)
        rest = columns - affine @ (affine.T @ columns)
        modes, sigma = pod(rest)
        useful = int(np.count_nonzero(sigma > DEPENDENT * sigma[0]))
        if useful >= k or handles == len(points):
            return modes[:, : min(k, useful)] / weight
        handles += 1
