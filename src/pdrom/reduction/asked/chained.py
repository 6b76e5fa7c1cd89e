"""Residuals of frames, chained to an estimate of the error of a run.

Wirtz, Sorensen and Haasdonk (SIAM J. Sci. Comput. 36, 2014) estimate the error of a DEIM model by a
scalar equation: the norm of the residual drives it, the logarithmic norm of the Jacobian at the
reduced state lets it grow. A frame is an implicit step, whose derivative there takes that place.
"""

from collections.abc import Iterable

import numpy as np


def growth(least: float) -> float:
    """Largest factor of a frame on an error (e, v), in the norm of |e|_D^2 + 2 h^2 |v|_D^2.

    A mode with the eigenvalue l of the Hessian relative to D goes on with (e + h v) / l. The norm
    is convex in 1 / l, hence largest for stiff modes or for ``least``, the l nearest to zero. Where
    all l are at least one it is sqrt(2), and no other weight of v makes it smaller.
    """
    m = np.array([0.0, 1.0 / least, 1.0 / abs(least)])
    # of the 2 x 2 matrix of a mode: squared Frobenius norm, determinant m
    f = 2.5 * m**2 + 2.0 * (m - 1.0) ** 2
    return float(np.sqrt(0.5 * (f + np.sqrt(np.maximum(f**2 - 4.0 * m**2, 0.0)))).max())


def chained(start: float, residuals: Iterable[float], least: Iterable[float]) -> float:
    """Estimated error after frames of norms of gradients in D^-1, ``residuals`` (F,) J^1/2.

    ``start`` is the error before them, in the norm of `growth`; ``least`` (F,) as there.
    """
    total = start
    for residual, value in zip(residuals, least, strict=True):
        # a defect d of the positions is one of d / h of the velocities
        total = growth(value) * total + np.sqrt(3.0) * residual / abs(value)
    return total
