"""Norms and relative errors of projections, and errors of trajectories, for the tables."""

import numpy as np


def squared_norms(p: np.ndarray) -> np.ndarray:
    """Return squared Frobenius norms (4,) of p (n frames, rows, 3): in total, and in x, y, z."""
    axes = np.einsum("nra,nra->a", p, p)
    return np.concatenate([[axes.sum()], axes])


def relative_errors(p: np.ndarray, p_hat: np.ndarray, roundoff: float) -> list[float | None]:
    """Return four || p - p_hat ||_F / || p ||_F over n frames: of all entries, of x, of y, of z.

    An error is None if || p ||_F is as small as its rounding errors (a relative error is then
    meaningless) or if p_hat is not finite.

    p, p_hat : (n, rows, 3) projections and their approximations
    roundoff : estimated Frobenius norm of the rounding errors in p
    """
    norm = np.sqrt(squared_norms(p))
    level = max(roundoff, np.finfo(float).eps * norm[0] * np.sqrt(p.size))
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.sqrt(squared_norms(p - p_hat))
    return [
        float(e / n) if n > level and np.isfinite(e) else None
        for e, n in zip(error, norm, strict=True)
    ]


def shape_residuals(
    positions: np.ndarray, reference: np.ndarray, masses: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return differences R q + t - q_ref in each of F frames after the best rigid motion R, t.

    R is the rotation, never a reflection, that minimises mass-weighted squares (Kabsch 1976), t
    aligns the centres of mass. ``positions`` q and ``reference`` q_ref are (F, N, 3) m, finite,
    ``masses`` (N,) kg. The differences (F, N, 3) are divided by the second result, (F,) m, because
    their squares in metres may overflow. It is at least as large as every coordinate of the frame.
    """
    largest = np.abs(positions).max(initial=0.0, axis=(1, 2), keepdims=True)
    scale = np.maximum(largest, np.abs(reference).max(initial=0.0, axis=(1, 2), keepdims=True))
    scale[scale == 0.0] = 1.0
    a, b = positions / scale, reference / scale
    weights = masses / masses.sum()
    a, b = (q - np.einsum("n,fna->fa", weights, q)[:, None] for q in (a, b))
    u, _, vt = np.linalg.svd((weights[:, None] * a).transpose(0, 2, 1) @ b)
    u[..., -1] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return a @ (u @ vt) - b, scale[:, 0, 0]


BLOCK = 32  # frames that are compared at a time, so that the memory used does not grow with the run


def shape_differences(
    positions: np.ndarray, reference: np.ndarray, masses: np.ndarray
) -> np.ndarray:
    """Return how far two runs differ in shape in each frame, as norms (F,) m.

    D_f(a, b)^2 is the least sum over the vertices of m_i / m |R a_i + t - b_i|^2 for all rotations
    R and translations t, with the mean mass m. ``positions`` a are (F, N, 3) m, or (N, 3) m in all
    frames, ``reference`` b (F, N, 3) m, ``masses`` (N,) kg.
    """
    positions, root = np.broadcast_to(positions, reference.shape), np.sqrt(masses / masses.mean())
    norms = [np.zeros(0)]
    for start in range(0, len(reference), BLOCK):
        block = slice(start, start + BLOCK)
        residuals, scale = shape_residuals(positions[block], reference[block], masses)
        norms.append(np.linalg.norm(residuals * root[:, None], axis=(1, 2)) * scale)
    return np.concatenate(norms)


def affine_residuals(rest: np.ndarray, reference: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Return norms (F,) m of ``reference`` minus the best affine image of the shape ``rest``.

    Norms are defined as in `shape_differences`. ``rest`` is (N, 3) m, ``reference`` (F, N, 3) m,
    ``masses`` (N,) kg.
    """
    root = np.sqrt(masses / masses.mean())[:, None]
    q, sigma, _ = np.linalg.svd(root * np.c_[rest, np.ones(len(rest))], full_matrices=False)
    q = q[:, sigma > 1e-12 * sigma[0]]
    weighted = root * reference
    return np.linalg.norm(weighted - q @ (q.T @ weighted), axis=(1, 2))


RIGID = 1e-3  # a body whose deformation is below this fraction of its size counts as rigid


def deformation_error(
    positions: np.ndarray, reference: np.ndarray, rest: np.ndarray, masses: np.ndarray
) -> float | None:
    """Return the error of a run's shapes, relative to the deformation of the reference.

    It is 0 for the reference moved rigidly in any way, 1 for a body that does not deform at all,
    and None if the body is rigid up to `RIGID` of its size or the reference has no frame. Rigid
    motions do not change it, so that the position error should be given as well. ``positions`` and
    ``reference`` are (F, N, 3) m, without the initial state, ``rest`` (N, 3) m, ``masses`` (N,) kg.
    """
    difference = shape_differences(positions, reference, masses)
    deformed = shape_differences(rest, reference, masses)
    return relative_deformation(difference, deformed, rest_size(rest, masses))


def rest_size(rest: np.ndarray, masses: np.ndarray) -> float:
    """Return the norm, m, of distances of vertices at ``rest`` (N, 3) m from their centre of mass.

    Squared distances are weighted by ``masses`` (N,) kg divided by their mean.
    """
    centred = rest - masses @ rest / masses.sum()
    return float(np.linalg.norm(np.sqrt(masses / masses.mean())[:, None] * centred))


def relative_deformation(difference: np.ndarray, deformed: np.ndarray, size: float) -> float | None:
    """Return `deformation_error` from `shape_differences` to a reference, each (F,) m.

    ``difference`` belongs to the run, ``deformed`` to the rest shape; ``size``, m, is `rest_size`.
    """
    whole = float(np.linalg.norm(deformed))
    if not whole > RIGID * size * np.sqrt(len(deformed)):
        return None
    return float(np.hypot.reduce(difference)) / whole  # squares may overflow


def trajectory_error(difference: np.ndarray, displacement: np.ndarray) -> float | None:
    """Return the relative error || Q_red - Q_fom || / || Q_fom - Q_0 || over F frames of a run.

    Q are positions of the reduced or full-order run; None if Q_fom stays at Q_0 or F = 0.

    difference, displacement : (F,) m, Frobenius norms of Q_red - Q_fom, Q_fom - Q_0 in each frame
    """
    moved = float(np.linalg.norm(displacement))
    return float(np.linalg.norm(difference)) / moved if moved > 0.0 else None
