"""Distance of a matrix to those with clamped singular values: residual and Hessian.

With D = S_e q = sum_i sigma_i v_i u_i^T (p x 3) the projection is P = sum_i f_i v_i u_i^T, f_i the
clamped sigma_i, and 1/2 |D - P|^2 has the gradient D - P. Eigenvectors of its Hessian are v_i u_i^T
(stretch), (v_i u_j^T +- v_j u_i^T) / sqrt 2 (shear and twist) and v_i n^T with n at right angles to
all u (turn of the plane). Their eigenvalues have a closed form (as in Smith et al. 2019 for other
energies); negative ones are raised. Springs are the case p = 1 with a range of one length.
"""

import numpy as np

from pdrom.model.constraints.lanes import cross, dot, lane_function, perpendicular, scaled

SWEEPS = 12  # of Jacobi rotations, at most; three rows need four or five
SMALL = 1e-14  # a row this much shorter than the longest has no direction of its own
MODES = 9


@lane_function
def _row(a, i):
    return (a[i, 0], a[i, 1], a[i, 2])


@lane_function
def _set_row(a, i, vector):
    a[i, 0], a[i, 1], a[i, 2] = vector


@lane_function
def _unit(a):
    return scaled(1.0 / np.sqrt(dot(a, a)), a)


@lane_function
def _rotate(d, v, p, i, j):
    """Make the rows i and j of d orthogonal; whether they were not."""
    a, b = _row(d, i), _row(d, j)
    alpha, beta, gamma = dot(a, a), dot(b, b), dot(a, b)
    if not abs(gamma) > 1e-16 * np.sqrt(alpha * beta):
        return False
    zeta = (beta - alpha) / (2.0 * gamma)
    t = np.copysign(1.0, zeta) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
    c = 1.0 / np.sqrt(1.0 + t * t)
    s = c * t
    for k in range(3):
        d[i, k], d[j, k] = c * d[i, k] - s * d[j, k], s * d[i, k] + c * d[j, k]
    for k in range(p):
        v[k, i], v[k, j] = c * v[k, i] - s * v[k, j], s * v[k, i] + c * v[k, j]
    return True


@lane_function
def _swap(d, v, p, i, j):
    """Exchange two rows, one of them with the other sign: v stays a rotation."""
    for k in range(3):
        d[i, k], d[j, k] = d[j, k], -d[i, k]
    for k in range(p):
        v[k, i], v[k, j] = v[k, j], -v[k, i]


@lane_function
def decompose(d, p, fallback, u, v, sigma):
    """D = sum_i sigma_i v_i u_i^T of the first p rows of ``d``, which is overwritten.

    Parameters
    ----------
    fallback : direction of u_0 where D is zero
    u : (3, 3) receives right-handed orthonormal rows, those from p on at right angles to D
    v : (3, 3) receives the columns v_i, a rotation
    sigma : (3,) receives singular values, largest first; for p = 3 the last carries the sign of
        the determinant
    """
    largest = 0.0
    for i in range(p):
        for k in range(3):
            largest = max(largest, abs(d[i, k]))
    v[:] = 0.0
    for i in range(p):
        v[i, i] = 1.0
        for k in range(3):
            d[i, k] /= largest if largest > 0.0 else 1.0
    for _ in range(SWEEPS):
        rotated = False
        for i in range(p):
            for j in range(i + 1, p):
                rotated = _rotate(d, v, p, i, j) or rotated
        if not rotated or p == 2:
            break
    for i in range(p):
        for j in range(i + 1, p):
            if dot(_row(d, j), _row(d, j)) > dot(_row(d, i), _row(d, i)):
                _swap(d, v, p, i, j)
    first = _row(d, 0) if largest > 0.0 else fallback
    _set_row(u, 0, _unit(first))
    a = _row(u, 0)
    b = perpendicular(a)
    if p > 1:
        own = _row(d, 1)
        part = dot(own, a)
        rest = (own[0] - part * a[0], own[1] - part * a[1], own[2] - part * a[2])
        if dot(rest, rest) > SMALL**2:
            b = _unit(rest)
    _set_row(u, 1, b)
    _set_row(u, 2, cross(a, b))
    for i in range(p):
        sigma[i] = largest * dot(_row(d, i), _row(u, i))


@lane_function
def clamped(x, low, high):
    """x within [low, high]."""
    return min(max(x, low), high)


@lane_function
def residual(u, v, sigma, p, low, high, r):
    """Write D - P to the first p rows of ``r`` (3, 3); |D - P|^2.

    Parameters
    ----------
    u, v, sigma : see `decompose`
    low, high : range that singular values are clamped to
    """
    square = 0.0
    r[:p] = 0.0
    for i in range(p):
        beyond = sigma[i] - clamped(sigma[i], low, high)
        square += beyond * beyond
        if beyond != 0.0:
            for row in range(p):
                for k in range(3):
                    r[row, k] += beyond * v[row, i] * u[i, k]
    return square


@lane_function
def _mode(values, modes, count, floor, value, v, u, p, i, j, sign):
    """Append (v_i u_j^T + sign v_j u_i^T), normalised, if its eigenvalue is positive."""
    if not value > floor:
        value = floor
    if value == 0.0:
        return count
    factor = 1.0 if sign == 0.0 else np.sqrt(0.5)
    for row in range(p):
        for k in range(3):
            entry = v[row, i] * u[j, k]
            if sign != 0.0:
                entry += sign * v[row, j] * u[i, k]
            modes[count, row, k] = factor * entry
    values[count] = value
    return count + 1


@lane_function
def hessian(u, v, sigma, p, low, high, floor, values, modes):
    """Eigenvalues and eigenvectors of the Hessian of 1/2 |D - P|^2; how many are written.

    Parameters
    ----------
    u, v, sigma : see `decompose`
    low, high : range that singular values are clamped to
    floor : in [0, 1]; smaller eigenvalues are raised to it, those that stay zero left out. All are
        at most 1, so that a floor of 1 gives the identity: the Hessian of projective dynamics.
    values : (MODES,)
    modes : (MODES, 3, 3), of each the first p rows
    """
    count = 0
    for i in range(p):
        f = clamped(sigma[i], low, high)
        inside = low < sigma[i] < high
        count = _mode(values, modes, count, floor, 0.0 if inside else 1.0, v, u, p, i, i, 0.0)
        for j in range(i + 1, p):
            g = clamped(sigma[j], low, high)
            gap, total = sigma[i] - sigma[j], sigma[i] + sigma[j]
            shear = (0.0 if inside else 1.0) if gap <= 0.0 else 1.0 - (f - g) / gap
            twist = 1.0 - (f + g) / total if total > 0.0 else 0.0
            count = _mode(values, modes, count, floor, shear, v, u, p, i, j, 1.0)
            count = _mode(values, modes, count, floor, twist, v, u, p, i, j, -1.0)
        for n in range(p, 3):
            across = 1.0 - f / sigma[i] if sigma[i] > 0.0 else 0.0
            count = _mode(values, modes, count, floor, across, v, u, p, i, n, 0.0)
    return count
