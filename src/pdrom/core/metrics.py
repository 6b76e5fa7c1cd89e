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


def trajectory_error(difference: np.ndarray, displacement: np.ndarray) -> float | None:
    """|| Q_red - Q_fom ||_F / || Q_fom - rest ||_F from the norms of each frame (F,).

    None where the full-order run never leaves its initial state, or no frame is given.
    """
    moved = float(np.linalg.norm(displacement))
    return float(np.linalg.norm(difference)) / moved if moved > 0.0 else None
