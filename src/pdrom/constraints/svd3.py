"""Compiled 3 x 3 kernels: signed singular value decomposition and nearest rotation.

Matrices are stored as in S q = F^T: ``f[k]`` is column k of F.
"""

import numpy as np
from numba import njit

from pdrom.constraints.vectors import perpendicular

SWEEPS = 12
TOLERANCE = 1e-15


@njit(cache=True, error_model="numpy")
def _rotate_columns(b, v, i, j):
    """One-sided Jacobi rotation that makes columns i and j orthogonal; True if it did something."""
    alpha = b[i, 0] * b[i, 0] + b[i, 1] * b[i, 1] + b[i, 2] * b[i, 2]
    beta = b[j, 0] * b[j, 0] + b[j, 1] * b[j, 1] + b[j, 2] * b[j, 2]
    gamma = b[i, 0] * b[j, 0] + b[i, 1] * b[j, 1] + b[i, 2] * b[j, 2]
    if gamma == 0.0 or abs(gamma) <= TOLERANCE * np.sqrt(alpha * beta):
        return False
    zeta = (beta - alpha) / (2.0 * gamma)
    t = 1.0 / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
    if zeta < 0.0:
        t = -t
    c = 1.0 / np.sqrt(1.0 + t * t)
    s = c * t
    for a in range(3):
        b[i, a], b[j, a] = c * b[i, a] - s * b[j, a], s * b[i, a] + c * b[j, a]
        v[i, a], v[j, a] = c * v[i, a] - s * v[j, a], s * v[i, a] + c * v[j, a]
    return True


@njit(cache=True, error_model="numpy")
def _norm(x):
    return np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


@njit(cache=True, error_model="numpy")
def _scale_of(f):
    largest = 0.0
    for i in range(3):
        for a in range(3):
            largest = max(largest, abs(f[i, a]))
    return largest


@njit(cache=True, error_model="numpy")
def signed_svd(f, u, sigma, v):
    """F = sum_k sigma_k u_k v_k^T with U and V rotations (det +1).

    Rows of ``u`` and ``v`` are the singular vectors. sigma is not sorted; the entry smallest in
    magnitude carries the sign of det F, the others are non-negative (Irving et al. 2004). Rank
    deficient matrices get a deterministic completion of U.
    """
    scale = _scale_of(f)
    b = u  # becomes U column by column
    for i in range(3):
        for a in range(3):
            b[i, a] = f[i, a] / scale if scale > 0.0 else 0.0
            v[i, a] = 1.0 if i == a else 0.0
    for _ in range(SWEEPS):
        moved = _rotate_columns(b, v, 0, 1)
        moved = _rotate_columns(b, v, 0, 2) or moved
        moved = _rotate_columns(b, v, 1, 2) or moved
        if not moved:
            break
    for i in range(3):
        sigma[i] = _norm(b[i])
    first, second, third = _order(sigma)
    _complete(b, sigma, first, second, third)
    for i in range(3):
        sigma[i] *= scale


@njit(cache=True, error_model="numpy")
def _order(sigma):
    """Indices of the largest, middle and smallest entry."""
    first, second, third = 0, 1, 2
    if sigma[first] < sigma[second]:
        first, second = second, first
    if sigma[second] < sigma[third]:
        second, third = third, second
    if sigma[first] < sigma[second]:
        first, second = second, first
    return first, second, third


@njit(cache=True, error_model="numpy")
def _complete(b, sigma, first, second, third):
    """Turn orthogonal columns of norms sigma into a rotation; sigma[third] becomes signed."""
    if sigma[first] > 0.0:
        for a in range(3):
            b[first, a] /= sigma[first]
    else:
        for a in range(3):
            b[first, a] = 1.0 if a == first else 0.0
    overlap = b[first, 0] * b[second, 0] + b[first, 1] * b[second, 1] + b[first, 2] * b[second, 2]
    for a in range(3):
        b[second, a] -= overlap * b[first, a]
    length = _norm(b[second])
    if length > TOLERANCE * sigma[first]:
        for a in range(3):
            b[second, a] /= length
    else:
        x0, x1, x2 = perpendicular(b[first, 0], b[first, 1], b[first, 2])
        b[second, 0], b[second, 1], b[second, 2] = x0, x1, x2
    old0, old1, old2 = b[third, 0], b[third, 1], b[third, 2]
    # (first, second, third) is an even permutation exactly if second follows first cyclically
    parity = 1.0 if (second - first) % 3 == 1 else -1.0
    x, y = b[first], b[second]
    b[third, 0] = parity * (x[1] * y[2] - x[2] * y[1])
    b[third, 1] = parity * (x[2] * y[0] - x[0] * y[2])
    b[third, 2] = parity * (x[0] * y[1] - x[1] * y[0])
    sigma[third] = b[third, 0] * old0 + b[third, 1] * old1 + b[third, 2] * old2


@njit(cache=True, error_model="numpy")
def clamp_singular_values(f, low, high, u, sigma, v, p):
    """Nearest matrix whose signed singular values lie in [low, high]; u, sigma, v are buffers."""
    signed_svd(f, u, sigma, v)
    for k in range(3):
        sigma[k] = min(max(sigma[k], low), high)
    for i in range(3):
        for a in range(3):
            p[i, a] = (
                sigma[0] * u[0, a] * v[0, i]
                + sigma[1] * u[1, a] * v[1, i]
                + sigma[2] * u[2, a] * v[2, i]
            )
