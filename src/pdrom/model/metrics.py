"""Norms and relative errors of projections, and errors of trajectories, for the tables."""

import numpy as np


def squared_norms(p: np.ndarray) -> np.ndarray:
    """Return squared Frobenius norms (4,) of p (n frames, rows, 3): in total, and in x, y, z."""
    axes = np.einsum("nra,nra->a", p, p)
    return np.concatenate([[axes.sum()], axes])


def relative_errors(p: np.ndarray, p_hat: np.ndarray, roundoff: float) -> list[float | None]:
    """Return four || p - p_hat ||_F / || p ||_F over n frames: of all entries, of x, of y, of z.

    An error is None if || p ||_F is at round-off level (a relative error is then meaningless) or if
    p_hat is not finite.

    Parameters
    ----------
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


def shape_residuals(positions: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return differences R q + t - q_ref in each of F frames after the best rigid motion R, t.

    R is the least-squares rotation, never a reflection (Kabsch 1976), t aligns the centroids.

    Parameters
    ----------
    positions, reference : (F, N, 3) m, finite: the q and the q_ref

    Returns
    -------
    residuals, scale
        (F, N, 3) differences divided by ``scale`` (F,) m, which is at least 1 m and at least every
        coordinate of the frame, as squares of differences in metres may overflow.
    """
    # scale both runs, since products of positions in an unstable run would overflow
    largest = np.abs(positions).max(initial=0.0, axis=(1, 2), keepdims=True)
    scale = np.maximum(np.maximum(largest, np.abs(reference).max(initial=0.0)), 1.0)
    a, b = positions / scale, reference / scale
    a = a - a.mean(axis=1, keepdims=True)
    b = b - b.mean(axis=1, keepdims=True)
    u, _, vt = np.linalg.svd(a.transpose(0, 2, 1) @ b)
    u[..., -1] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return a @ (u @ vt) - b, scale[:, 0, 0]


def shape_differences(positions: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return norms (F,) m of two runs' differences in each frame after the best rigid motion.

    ``positions`` and ``reference`` are (F, N, 3) m, finite.
    """
    residuals, scale = shape_residuals(positions, reference)
    return np.linalg.norm(residuals, axis=(1, 2)) * scale


def deformation(positions: np.ndarray, reference: np.ndarray, masses: np.ndarray) -> float:
    """Return how far two runs differ in shape, m sqrt(kg): the root of the sum of D_f^2.

    D_f(a, b)^2 is the least sum over the vertices of m_i |R a_i + t - b_i|^2, R a rotation, never a
    reflection (Kabsch 1976), t a translation, in frame f of F.

    Parameters
    ----------
    positions : (F, N, 3) m, a; or (N, 3) m, the same shape in all frames
    reference : (F, N, 3) m, b
    masses : (N,) kg
    """
    scale = max(
        float(np.abs(positions).max(initial=0.0)), float(np.abs(reference).max(initial=0.0))
    )
    if scale == 0.0 or not np.isfinite(scale):
        return scale
    weights, root = masses / masses.sum(), np.sqrt(masses / masses.sum())[:, None]
    total = 0.0
    for a, b in zip(np.broadcast_to(positions, reference.shape), reference, strict=True):
        a, b = a / scale, b / scale
        a, b = root * (a - weights @ a), root * (b - weights @ b)
        u, _, vt = np.linalg.svd(a.T @ b)
        u[:, -1] *= np.sign(np.linalg.det(u @ vt))
        total += float(np.sum((a @ (u @ vt) - b) ** 2))
    return scale * float(np.sqrt(total * masses.sum()))


RIGID = 1e-3  # a body whose deformation is below this fraction of its size counts as rigid


def deformation_error(
    positions: np.ndarray, reference: np.ndarray, rest: np.ndarray, masses: np.ndarray
) -> float | None:
    """Return the error of a run's shapes, relative to the deformation of the reference.

    It is 0 for the reference moved rigidly in any way, 1 for a body that does not deform at all,
    and None if the body is rigid to `RIGID` of its size or the reference has no frame. It does not
    see errors of the rigid motion: state the error of the positions as well.

    Parameters
    ----------
    positions, reference : (F, N, 3) m, without the initial state
    rest : (N, 3) m, the rest shape
    masses : (N,) kg
    """
    centred = rest - masses @ rest / masses.sum()
    size = float(np.sqrt(len(reference) * np.sum(masses[:, None] * centred**2)))
    deformed = deformation(rest, reference, masses)
    if not deformed > RIGID * size:
        return None
    return deformation(positions, reference, masses) / deformed


def trajectory_error(difference: np.ndarray, displacement: np.ndarray) -> float | None:
    """Return the relative error || Q_red - Q_fom || / || Q_fom - Q_0 || over F frames of a run.

    Q are positions of the reduced or full-order run; None if the full order stays at Q_0 or F = 0.

    Parameters
    ----------
    difference, displacement : (F,) m, Frobenius norms of Q_red - Q_fom, Q_fom - Q_0 in each frame
    """
    moved = float(np.linalg.norm(displacement))
    return float(np.linalg.norm(difference)) / moved if moved > 0.0 else None
