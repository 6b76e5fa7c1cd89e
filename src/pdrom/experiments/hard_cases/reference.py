"""Projections in arithmetic of 50 digits and more (mpmath), straight from their definitions."""

import math

import mpmath
import numpy as np
from mpmath import mp

DIGITS = 50


def digits_for(*arrays: np.ndarray) -> int:
    """Digits that keep 50 of them after squares and differences of the entries."""
    entries = np.abs(np.concatenate([np.ravel(a) for a in arrays]))
    entries = entries[entries > 0.0]
    if len(entries) == 0:
        return DIGITS
    return DIGITS + 2 * math.ceil(math.log10(entries.max()) - math.log10(entries.min()))


def exact(a: np.ndarray) -> mpmath.matrix:
    """A double array (n, m) as a matrix of the same numbers."""
    return mpmath.matrix(a.tolist())


def clamped(d: np.ndarray, low: float, high: float) -> tuple[mpmath.matrix, mpmath.mpf]:
    """Nearest matrix to d = F^T, (2 or 3, 3), with signed singular values in [low, high].

    For three rows the smallest singular value carries the sign of det F. The second result is the
    condition number sigma_1 / (sigma_2 + sigma_3): perturbing F relatively by u turns p by at most
    a small multiple of it times u; infinite where p is not unique. A triangle has sigma_3 = 0.
    """
    u, sigma, vt = mp.svd_r(exact(d))
    values = list(sigma)
    third = mpmath.mpf(0)
    if len(values) == 3:
        sign = mp.sign(mp.det(u) * mp.det(vt))
        values[2] *= sign
        third = values[2]
        for i in range(3):
            u[i, 2] *= sign
    # the bounds are the doubles that the kernels get
    ends = [min(max(v, mpmath.mpf(low)), mpmath.mpf(high)) for v in values]
    p = u * mpmath.diag(ends) * vt
    gap = values[1] + third
    return p, (values[0] / gap if gap > 0 else mp.inf)


def spring(d: np.ndarray, rest: np.ndarray) -> mpmath.matrix:
    """The vector d (1, 3) with the length of ``rest`` (3,); ``rest`` itself for d = 0."""
    vector, target = exact(d), exact(rest[None])
    length = mp.norm(vector)
    return vector * (mp.norm(target) / length) if length else target


def half_sphere(
    row: np.ndarray, y: np.ndarray, magnitude: float, normal: np.ndarray
) -> tuple[mpmath.matrix, mpmath.mpf]:
    """Nearest point to H = row y of the half sphere of radius ``magnitude`` about ``normal``.

    Parameters
    ----------
    row : (n,) of S
    y : (n, 3)
    normal : (3,) pole, with the side as its sign; zero for the whole sphere

    Returns
    -------
    The point (1, 3), and the condition number: the terms that cancel in H over |H|, and where H is
    on the wrong side, over the distance of its direction from the opposite pole.
    """
    h, n = exact(row[None]) * exact(y), exact(normal[None])
    terms = mp.norm(exact(np.abs(row)[None]) * exact(np.abs(y)))
    length = mp.norm(h)
    direction = h / length
    condition = terms / length
    height = mp.fsum(direction[i] * n[i] for i in range(3))
    if height < 0:
        direction = direction - height * n
        condition /= mp.norm(direction)
        direction /= mp.norm(direction)
    return direction * mpmath.mpf(magnitude), condition
