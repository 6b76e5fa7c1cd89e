"""Projections in arithmetic of 50 digits and more (mpmath), straight from their definitions."""

import math
from itertools import pairwise

import mpmath
import numpy as np
from mpmath import mp

DIGITS = 50
GRID = 60


def digits_for(*arrays: np.ndarray) -> int:
    """Digits that keep 50 after squares and differences of the entries of ``arrays``."""
    entries = np.abs(np.concatenate([np.ravel(a) for a in arrays]))
    entries = entries[entries > 0.0]
    if len(entries) == 0:
        return DIGITS
    return DIGITS + 2 * math.ceil(math.log10(entries.max()) - math.log10(entries.min()))


def exact(a: np.ndarray) -> mpmath.matrix:
    """A double array ``a`` (n, m) as a matrix of the same numbers."""
    return mpmath.matrix(a.tolist())


def clamped(d: np.ndarray, low: float, high: float) -> tuple[mpmath.matrix, mpmath.mpf]:
    """Nearest matrix to d = F^T, (2 or 3, 3), with signed singular values in [low, high].

    For three rows the smallest singular value carries the sign of det F. The second result is the
    condition number sigma_1 / (sigma_2 + sigma_3): perturbing F relatively by u turns p by at most
    a small multiple of it times u; infinite where p is not unique. A triangle has sigma_3 = 0.
    """
    u, values, vt = _signed_svd(d)
    third = values[2] if len(values) == 3 else mpmath.mpf(0)
    # the bounds are the doubles that the kernels get
    ends = [min(max(v, mpmath.mpf(low)), mpmath.mpf(high)) for v in values]
    p = u * mpmath.diag(ends) * vt
    gap = values[1] + third
    return p, (values[0] / gap if gap > 0 else mp.inf)


def _signed_svd(d: np.ndarray) -> tuple[mpmath.matrix, list[mpmath.mpf], mpmath.matrix]:
    """Singular value decomposition; of three values the last carries the sign of det F."""
    u, sigma, vt = mp.svd_r(exact(d))
    values = list(sigma)
    if len(values) == 3:
        sign = mp.sign(mp.det(u) * mp.det(vt))
        values[2] *= sign
        for i in range(3):
            u[i, 2] *= sign
    return u, values, vt


def sized(d: np.ndarray, low: float, high: float) -> tuple[mpmath.matrix, mpmath.mpf]:
    """Nearest matrix to d = F^T, (2 or 3, 3), whose area or volume lies in [low, high] > 0.

    That is the product of its singular values, the smallest of three with the sign of det F. The
    second result is the condition number, infinite where p is not unique.
    """
    u, values, vt = _signed_svd(d)
    product = mp.fprod(values)
    bound = min(max(product, mpmath.mpf(low)), mpmath.mpf(high))
    if product == bound:
        return exact(d), mpmath.mpf(1)
    found = _with_product(values, bound)
    return u * mpmath.diag(found) * vt, _condition(values, found)


def _with_product(values: list[mpmath.mpf], bound: mpmath.mpf) -> list[mpmath.mpf]:
    """Nearest t_i > 0 to ``values`` with the product ``bound``: all t_i (t_i - s_i) are equal.

    The last one is the unknown, every sign change of the product on a grid holds a candidate.
    """
    last, count = values[-1], len(values)

    def belonging(t: mpmath.mpf) -> list[mpmath.mpf]:
        m = t * (t - last)
        return [(s + mp.sqrt(max(s * s + 4 * m, 0))) / 2 for s in values[:-1]] + [t]

    def excess(t: mpmath.mpf) -> mpmath.mpf:
        return mp.fprod(belonging(t)) / bound - 1

    if mp.fprod(values) < bound:
        grid = [mpmath.mpf(0), 2 * max(last, mp.root(bound, count))]
    else:
        least = bound / mp.fprod(values[:-1])
        grid = [least * (last / least) ** (mpmath.mpf(i) / GRID) for i in range(GRID + 1)]
    above = [excess(t) > 0 for t in grid]
    ends = [pair for i, pair in enumerate(pairwise(grid)) if above[i + 1] and not above[i]]
    roots = [mp.findroot(excess, pair, solver="anderson", verify=False) for pair in ends]
    return min(
        (belonging(t) for t in roots),
        key=lambda found: mp.fsum((a - s) ** 2 for a, s in zip(found, values, strict=True)),
    )


def _condition(values: list[mpmath.mpf], found: list[mpmath.mpf]) -> mpmath.mpf:
    """Largest factor by which a relative change of ``values``, or of their directions, grows."""
    pairs = list(zip(values, found, strict=True))
    slopes = [2 * t - s for s, t in pairs]
    curved = mp.fsum(1 / (a * t) for a, (_, t) in zip(slopes, pairs, strict=True))
    factors = []
    for i, (s, t) in enumerate(pairs):
        # dt_j / ds_i from t_j (t_j - s_j) = m and sum_j dt_j / t_j = 0
        m = -1 / (slopes[i] * curved)
        factors += [((t if i == j else 0) + m) / a for j, a in enumerate(slopes)]
        for other, beside in pairs[i + 1 :]:
            factors.append((t + beside) / (s + other) if s + other else mp.inf)
            tie = t / slopes[i] if t == beside else mp.inf
            factors.append((t - beside) / (s - other) if s != other else tie)
        if len(pairs) == 2:
            factors.append(t / s if s else mp.inf)
    return max(abs(f) for f in factors) * mp.norm(values) / mp.norm(found)


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
