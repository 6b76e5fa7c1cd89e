"""Compiled nearest rotation of a well-conditioned 3 x 3 matrix by Newton's iteration.

X <- (X + X^-T) / 2 converges quadratically to the orthogonal polar factor (Higham 1986). It is only
used for matrices far from singular and with positive determinant; `pdrom.constraints.svd3` does the
others.
"""

import numpy as np
from numba import njit

STEPS = 16
# det F relative to the cube of the mean singular value: below it the SVD takes over
WELL_CONDITIONED = 1e-2


@njit(cache=True, error_model="numpy")
def newton_rotation(f, p):
    """Write the nearest rotation of ``f`` (3, 3) to ``p``; False if ``f`` is not suited."""
    a, b, c = f[0, 0], f[0, 1], f[0, 2]
    d, e, g = f[1, 0], f[1, 1], f[1, 2]
    h, i, j = f[2, 0], f[2, 1], f[2, 2]
    square = (a * a + b * b + c * c + d * d + e * e + g * g + h * h + i * i + j * j) / 3.0
    determinant = a * (e * j - g * i) - b * (d * j - g * h) + c * (d * i - e * h)
    if not determinant > WELL_CONDITIONED * square * np.sqrt(square):
        return False
    scale = 1.0 / np.cbrt(determinant)
    a, b, c, d, e, g, h, i, j = (
        a * scale, b * scale, c * scale, d * scale, e * scale,
        g * scale, h * scale, i * scale, j * scale,
    )  # fmt: skip
    for _ in range(STEPS):
        ca, cb, cc = e * j - g * i, g * h - d * j, d * i - e * h
        cd, ce, cg = c * i - b * j, a * j - c * h, b * h - a * i
        ch, ci, cj = b * g - c * e, c * d - a * g, a * e - b * d
        inverse = 0.5 / (a * ca + b * cb + c * cc)
        na, nb, nc = 0.5 * a + inverse * ca, 0.5 * b + inverse * cb, 0.5 * c + inverse * cc
        nd, ne, ng = 0.5 * d + inverse * cd, 0.5 * e + inverse * ce, 0.5 * g + inverse * cg
        nh, ni, nj = 0.5 * h + inverse * ch, 0.5 * i + inverse * ci, 0.5 * j + inverse * cj
        change = (
            (na - a) ** 2 + (nb - b) ** 2 + (nc - c) ** 2 + (nd - d) ** 2 + (ne - e) ** 2
            + (ng - g) ** 2 + (nh - h) ** 2 + (ni - i) ** 2 + (nj - j) ** 2
        )  # fmt: skip
        a, b, c, d, e, g, h, i, j = na, nb, nc, nd, ne, ng, nh, ni, nj
        # quadratic convergence: a change of 1e-9 leaves an error of 1e-18
        if change < 1e-18:
            p[0, 0], p[0, 1], p[0, 2] = a, b, c
            p[1, 0], p[1, 1], p[1, 2] = d, e, g
            p[2, 0], p[2, 1], p[2, 2] = h, i, j
            return True
    return False


@njit(cache=True, error_model="numpy")
def within_range(f, low, high):
    """True if all singular values surely lie in [low, high] and det F > 0 (a sufficient test).

    |F^T F - I|_F bounds the distance of every squared singular value from 1.
    """
    slack = min(1.0 - low * low, high * high - 1.0)
    total = 0.0
    for i in range(3):
        for k in range(i, 3):
            gram = f[i, 0] * f[k, 0] + f[i, 1] * f[k, 1] + f[i, 2] * f[k, 2]
            if i == k:
                total += (gram - 1.0) ** 2
            else:
                total += 2.0 * gram * gram
    if not total < slack * slack:
        return False
    determinant = (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )
    return determinant > 0.0
