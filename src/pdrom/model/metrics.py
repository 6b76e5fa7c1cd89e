"""Errors and norms of the tables."""

import numpy as np


def squared_norms(p: np.ndarray) -> np.ndarray:
    """Squared Frobenius norms of p (n, rows, 3): of everything, of x, of y, of z; (4,)."""
    axes = np.einsum("nra,nra->a", p, p)
    return np.concatenate([[axes.sum()], axes])


def relative_errors(p: np.ndarray, p_hat: np.ndarray, roundoff: float) -> list[float | None]:
    """|| p - p^ ||_F / || p ||_F over all frames: total, x, y, z.

    None where the reference norm is at round-off level (there is no relative error of noise) or
    where the reconstruction does not exist.

    Parameters
    ----------
    p, p_hat : (n, rows, 3)
    roundoff : Frobenius norm of the rounding errors in p
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
    """Vectors R q + t - q_ref of each frame, which no rigid motion explains, in units of a scale.

    R is the best rotation, never a reflection (Kabsch 1976), t joins the centroids.

    Parameters
    ----------
    positions, reference : (F, N, 3) m, finite

    Returns
    -------
    residuals, scale
        (F, N, 3) and (F,) m; apart, because squares in metres may overflow.
    """
    # the same scale for both: products of a run that has grown out of bounds would overflow
    largest = np.abs(positions).max(initial=0.0, axis=(1, 2), keepdims=True)
    scale = np.maximum(np.maximum(largest, np.abs(reference).max(initial=0.0)), 1.0)
    a, b = positions / scale, reference / scale
    a = a - a.mean(axis=1, keepdims=True)
    b = b - b.mean(axis=1, keepdims=True)
    u, _, vt = np.linalg.svd(a.transpose(0, 2, 1) @ b)
    u[..., -1] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return a @ (u @ vt) - b, scale[:, 0, 0]


def shape_differences(positions: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Frobenius norm of the `shape_residuals` of each frame, (F,) m.

    Parameters
    ----------
    positions, reference : (F, N, 3) m, finite
    """
    residuals, scale = shape_residuals(positions, reference)
    return np.linalg.norm(residuals, axis=(1, 2)) * scale


def trajectory_error(difference: np.ndarray, displacement: np.ndarray) -> float | None:
    """|| Q_red - Q_fom ||_F / || Q_fom - rest ||_F from the norms of each frame, m.

    None where the full-order run never leaves its initial state, or no frame is given.

    Parameters
    ----------
    difference, displacement : (F,) numerators and denominators
    """
    moved = float(np.linalg.norm(displacement))
    return float(np.linalg.norm(difference)) / moved if moved > 0.0 else None
