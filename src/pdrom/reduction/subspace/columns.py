"""Columns B (N, K) of a position subspace q = B z with coordinates z (K, 3); axes share B.

The free vertices get k modes and, always, the affine columns 1, x, y, z of the rest shape: the
space contains the rest shape and every rigid motion. Vertices that a boundary condition holds at
any time form atoms, sets that are held and released together. Each atom has its own columns: affine
ones and POD modes of its released motion. While an atom is held its coordinates are fixed, so that
pins and handles are met exactly; otherwise they are unknowns. The space never changes in a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from pdrom.model.effects.base import Boundary
from pdrom.model.mesh.selection import farthest_points
from pdrom.reduction.basis import fix_signs, pod

# A column is dropped if its component orthogonal to the earlier ones is relatively below this.
DEPENDENT = 1e-9

# Relative tolerance at which the POD modes of an atom's non-affine motion are truncated.
OWN_MOTION = 1e-3

# Motion below this fraction of the positions is round-off.
ROUNDOFF = 100.0 * np.finfo(float).eps


@dataclass(frozen=True)
class Columns:
    """A position subspace.

    B : (N, K) columns; the free ones are mass-orthonormal
    free : indices of the columns of the free vertices
    atoms : vertex sets that are held and released together
    atom_columns : for each atom, the indices of its columns
    modes : number k of modes, not counting the affine columns
    """

    B: np.ndarray
    free: np.ndarray
    atoms: list[np.ndarray]
    atom_columns: list[np.ndarray]
    modes: int


def affine_columns(points: np.ndarray) -> np.ndarray:
    """Columns 1, x, y, z, (N, 4), of the rest shape ``points`` (N, 3) m."""
    return np.column_stack([np.ones(len(points)), points])


def displacement_modes(
    trajectory: np.ndarray, points: np.ndarray, masses: np.ndarray, k: int
) -> np.ndarray:
    """First k POD modes (N, k) of displacements, mass-weighted, without their affine part.

    Each axis of each frame of ``trajectory`` (n, N, 3) is one snapshot, so that x, y and z share
    the modes (Monem et al. 2023). Fewer are returned if the data contain fewer.

    Parameters
    ----------
    points : (N, 3) m, rest shape
    masses : (N,) kg
    """
    displacements = (trajectory - points).transpose(1, 0, 2).reshape(len(points), -1)
    weight = np.sqrt(masses)[:, None]
    affine = orthonormal(weight * affine_columns(points))
    rest = weight * displacements
    rest = rest - affine @ (affine.T @ rest)
    modes, sigma = pod(rest)
    # the remainder of an entirely affine motion is round-off
    noise = ROUNDOFF * float(np.linalg.norm(weight[:, :, None] * trajectory.transpose(1, 0, 2)))
    useful = int(np.count_nonzero(sigma > max(DEPENDENT * sigma[0], noise)))
    return modes[:, : min(k, useful)] / weight


def build_columns(
    modes: np.ndarray,
    points: np.ndarray,
    masses: np.ndarray,
    atoms: Sequence[np.ndarray],
    trajectory: np.ndarray,
) -> Columns:
    """Build the space from ``modes`` (N, k) on the free vertices and columns of each atom.

    An atom has affine columns and, where its motion in ``trajectory`` (n, N, 3) is not affine, POD
    modes of the remainder, truncated at the relative error `OWN_MOTION`.

    Parameters
    ----------
    points : (N, 3) m, rest shape
    masses : (N,) kg
    """
    n = len(points)
    free_vertices = np.setdiff1d(np.arange(n), np.concatenate([np.empty(0, np.int64), *atoms]))
    weight = np.sqrt(masses[free_vertices])[:, None]
    raw = np.hstack([affine_columns(points), modes])[free_vertices]
    blocks = [(free_vertices, orthonormal(weight * raw) / weight)]
    blocks += [(a, _atom_columns(a, points, trajectory, modes.shape[1])) for a in atoms]
    ends = np.cumsum([block.shape[1] for _, block in blocks])
    ranges = np.split(np.arange(ends[-1]), ends[:-1])
    b = np.zeros((n, ends[-1]))
    for (vertices, block), own in zip(blocks, ranges, strict=True):
        b[np.ix_(vertices, own)] = block
    return Columns(b, ranges[0], list(atoms), ranges[1:], modes.shape[1])


def _atom_columns(
    atom: np.ndarray, points: np.ndarray, trajectory: np.ndarray, most: int
) -> np.ndarray:
    affine = orthonormal(affine_columns(points[atom]))
    motion = (trajectory[:, atom] - points[atom]).transpose(1, 0, 2).reshape(len(atom), -1)
    rest = motion - affine @ (affine.T @ motion)
    modes, sigma = pod(rest)
    scale = max(float(np.linalg.norm(motion)), np.finfo(float).eps * np.linalg.norm(points[atom]))
    found = int(np.count_nonzero(sigma > OWN_MOTION * scale))
    count = min(found, most, len(atom) - affine.shape[1])
    return np.hstack([affine, modes[:, :count]])


def orthonormal(columns: np.ndarray) -> np.ndarray:
    """Orthonormalise ``columns`` (n, k) in their order; dependent columns are dropped."""
    kept: list[np.ndarray] = []
    for column in columns.T:
        norm = np.linalg.norm(column)
        rest = column.copy()
        for _ in range(2):  # twice is enough (Kahan and Parlett)
            for other in kept:
                rest -= other * (other @ rest)
        if norm > 0.0 and np.linalg.norm(rest) > DEPENDENT * norm:
            kept.append(rest / np.linalg.norm(rest))
    if not kept:
        return np.empty((len(columns), 0))
    return fix_signs(linalg.qr(np.stack(kept, axis=1), mode="economic")[0])


def atoms(boundaries: Sequence[Boundary], vertices: int) -> list[np.ndarray]:
    """Disjoint sets of vertices whose union is all vertices that a boundary ever holds.

    Two vertices share an atom if the same units of the boundaries hold them; a unit is then a union
    of atoms, and holding it fixes whole atoms.
    """
    units = [unit for boundary in boundaries for unit in boundary.units()]
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
    """Weights (N, handles) at ``points`` (N, 3) m: smooth, in [0, 1], summing to 1 at every vertex.

    Handles are vertices by farthest-point sampling. Each has the compactly supported kernel
    (1 - d/R)^4 (4 d/R + 1) of Wendland with R three times the covering radius, so that every vertex
    lies in the support of a kernel; dividing by the sum makes a partition of unity.
    """
    chosen = farthest_points(points, np.arange(len(points)), handles)
    distance = np.linalg.norm(points[:, None, :] - points[chosen][None], axis=2)
    radius = 3.0 * distance.min(axis=1).max() if handles > 1 else 2.0 * distance.max()
    # the covering radius is zero if every vertex is a handle; for one vertex all distances are
    radius = max(radius, np.finfo(float).eps * distance.max(), np.finfo(float).tiny)
    scaled = np.minimum(distance / radius, 1.0)
    kernel = (1.0 - scaled) ** 4 * (4.0 * scaled + 1.0)
    return kernel / kernel.sum(axis=1, keepdims=True)


def skinning_modes(points: np.ndarray, masses: np.ndarray, k: int) -> np.ndarray:
    """k mass-orthonormal columns (N, k) in the span of w_h [1, x, y, z], affine part removed.

    w_h are the `skinning_weights` of as many handles as k columns need. Of more than k columns
    those with the largest singular values are kept, so that bases of equal size are compared.

    Parameters
    ----------
    points : (N, 3) m
    masses : (N,) kg
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
