"""Compiled 3 x 3 projection: signed singular values clamped to a range, for blocks of matrices.

One-sided Jacobi (Hestenes 1958; Demmel and Veselic 1992): rotations V make the columns of B = F V
orthogonal, their norms are the singular values. It works on F, never on F^T F, so that small
singular values and their directions keep their relative accuracy. Matrices are stored as in
S q = F^T: vector k of a matrix is column k of F. See module `lanes` for the layout.
"""

import numpy as np

from pdrom.model.constraints.lanes import (
    LANES,
    SMALLEST,
    absolute_sum,
    choose,
    clamp,
    cross,
    dot,
    lane_function,
    load,
    mix,
    mix3,
    perpendicular,
    save,
    scaled,
)

SWEEPS = 12
# columns whose cosine is below are orthogonal
ORTHOGONAL = 1e-15
# after a sweep of smaller rotations than this the cosines are of the size of its square
LAST_TANGENT = 1e-8
# a second singular value below this fraction of the first has no direction
RANK = 1e-15


# numbers of a lane in the working array of `clamp_block`, and with the singular values that
# `factor_block` leaves there
B, V, SCALE, DONE = 0, 9, 18, 19
SIZE = 20
SIGMA, FACTORS = 20, 23


@lane_function
def jacobi_rotation(a, b, done):
    """Cosine, sine, |tangent| of the rotation that makes columns a and b orthogonal.

    It is none where the lane is ``done``.
    """
    alpha, beta, gamma = dot(a, a), dot(b, b), dot(a, b)
    half = 0.5 * (beta - alpha)
    root = abs(half) + np.sqrt(half * half + gamma * gamma)
    idle = done or gamma * gamma <= ORTHOGONAL * ORTHOGONAL * alpha * beta or root == 0.0
    tangent = 0.0 if idle else gamma / root
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = cosine * tangent
    return cosine, -sine if half < 0.0 else sine, abs(tangent)


@lane_function
def _sweep(work):
    """Rotate all pairs of columns once in the lanes that are not done; number of lanes left."""
    left = 0.0
    for lane in range(LANES):
        b0, b1, b2 = load(work, B, lane), load(work, B + 3, lane), load(work, B + 6, lane)
        v0, v1, v2 = load(work, V, lane), load(work, V + 3, lane), load(work, V + 6, lane)
        done = work[DONE * LANES + lane] != 0.0
        c, s, t01 = jacobi_rotation(b0, b1, done)
        b0, b1 = mix(c, b0, -s, b1), mix(s, b0, c, b1)
        v0, v1 = mix(c, v0, -s, v1), mix(s, v0, c, v1)
        c, s, t02 = jacobi_rotation(b0, b2, done)
        b0, b2 = mix(c, b0, -s, b2), mix(s, b0, c, b2)
        v0, v2 = mix(c, v0, -s, v2), mix(s, v0, c, v2)
        c, s, t12 = jacobi_rotation(b1, b2, done)
        b1, b2 = mix(c, b1, -s, b2), mix(s, b1, c, b2)
        v1, v2 = mix(c, v1, -s, v2), mix(s, v1, c, v2)
        save(work, B, lane, b0)
        save(work, B + 3, lane, b1)
        save(work, B + 6, lane, b2)
        save(work, V, lane, v0)
        save(work, V + 3, lane, v1)
        save(work, V + 6, lane, v2)
        more = 1.0 if t01 > LAST_TANGENT or t02 > LAST_TANGENT or t12 > LAST_TANGENT else 0.0
        work[DONE * LANES + lane] = 1.0 - more
    for lane in range(LANES):
        left += 1.0 - work[DONE * LANES + lane]
    return left


@lane_function
def _larger_first(a, v, b, w):
    """Swap two columns and their right vectors if the second is longer; one changes sign.

    The sign keeps V a rotation.
    """
    swap = dot(a, a) < dot(b, b)
    return (
        choose(swap, b, a),
        choose(swap, w, v),
        choose(swap, scaled(-1.0, a), b),
        choose(swap, scaled(-1.0, v), w),
    )


@lane_function
def orthonormal_pair(b0, b1):
    """Directions and norms of two orthogonal columns ``b0`` and ``b1``, the longer first.

    A column that vanishes gets a direction in a fixed way.
    """
    s0 = np.sqrt(dot(b0, b0))
    u0 = choose(s0 > 0.0, scaled(1.0 / s0, b0), (1.0, 0.0, 0.0))
    # what rounding left of the large column in the small one would tilt its direction
    b1 = mix(1.0, b1, -dot(u0, b1), u0)
    s1 = np.sqrt(dot(b1, b1))
    u1 = choose(s1 > RANK * s0, scaled(1.0 / s1, b1), perpendicular(u0))
    return u0, u1, s0, s1


@lane_function
def _diagonalise(f, at_f, keep, work):
    """Leave B = F V / scale with orthogonal columns, V and scale; lanes to ``keep`` are left."""
    for lane in range(LANES):
        f0, f1, f2 = load(f, at_f, lane), load(f, at_f + 3, lane), load(f, at_f + 6, lane)
        scale = absolute_sum(f0) + absolute_sum(f1) + absolute_sum(f2) + SMALLEST
        save(work, B, lane, scaled(1.0 / scale, f0))
        save(work, B + 3, lane, scaled(1.0 / scale, f1))
        save(work, B + 6, lane, scaled(1.0 / scale, f2))
        save(work, V, lane, (1.0, 0.0, 0.0))
        save(work, V + 3, lane, (0.0, 1.0, 0.0))
        save(work, V + 6, lane, (0.0, 0.0, 1.0))
        work[SCALE * LANES + lane] = scale
        work[DONE * LANES + lane] = keep[lane]
    for _ in range(SWEEPS):
        if _sweep(work) == 0.0:
            break


@lane_function
def _factors(work, lane):
    """Columns of U and V and the singular values over the scale, the largest first."""
    b0, b1, b2 = load(work, B, lane), load(work, B + 3, lane), load(work, B + 6, lane)
    v0, v1, v2 = load(work, V, lane), load(work, V + 3, lane), load(work, V + 6, lane)
    b0, v0, b1, v1 = _larger_first(b0, v0, b1, v1)
    b1, v1, b2, v2 = _larger_first(b1, v1, b2, v2)
    b0, v0, b1, v1 = _larger_first(b0, v0, b1, v1)
    u0, u1, s0, s1 = orthonormal_pair(b0, b1)
    # U has det +1, so that the last singular value takes the sign of det F (Irving et al. 2004)
    u2 = cross(u0, u1)
    return (u0, u1, u2), (v0, v1, v2), (s0, s1, dot(u2, b2))


@lane_function
def _compose(u, v, sigma, p, at_p, lane, kept):
    """Write U diag(sigma) V^T to P unless it is kept."""
    u0, u1, u2 = scaled(sigma[0], u[0]), scaled(sigma[1], u[1]), scaled(sigma[2], u[2])
    for i in range(3):
        column = mix3(v[0][i], u0, v[1][i], u1, v[2][i], u2)
        save(p, at_p + 3 * i, lane, choose(kept, load(p, at_p + 3 * i, lane), column))


@lane_function
def clamp_block(f, at_f, p, at_p, keep, low, high, work):
    """Write the matrix nearest to F with signed singular values in [low, high] to P.

    Parameters
    ----------
    f, at_f, p, at_p : blocks of matrices and the number at which F and P begin in them
    keep : (LANES,) lanes with a non-zero entry keep their P
    work : `SIZE` numbers a lane

    A matrix with an entry that is not finite gives nan.
    """
    _diagonalise(f, at_f, keep, work)
    for lane in range(LANES):
        u, v, s = _factors(work, lane)
        scale = work[SCALE * LANES + lane]
        first, second = clamp(scale * s[0], low, high), clamp(scale * s[1], low, high)
        sigma = first + 0.0 * scale, second, clamp(scale * s[2], low, high)
        _compose(u, v, sigma, p, at_p, lane, keep[lane] != 0.0)


@lane_function
def factor_block(f, at_f, keep, work):
    """Leave U in `B`, V in `V` and the signed singular values, largest first, in `SIGMA`.

    ``f``, ``at_f``, ``keep`` and ``work`` as in `clamp_block`, with `FACTORS` numbers a lane.
    """
    _diagonalise(f, at_f, keep, work)
    for lane in range(LANES):
        u, v, s = _factors(work, lane)
        for i in range(3):
            save(work, B + 3 * i, lane, u[i])
            save(work, V + 3 * i, lane, v[i])
        save(work, SIGMA, lane, scaled(work[SCALE * LANES + lane], s))


@lane_function
def compose_block(sigma, at_sigma, p, at_p, keep, work):
    """Write U diag(sigma) V^T to P, with the U and V that `factor_block` left in ``work``.

    P and sigma begin at the numbers ``at_p`` of ``p`` and ``at_sigma`` of ``sigma``; lanes to
    ``keep`` are left as they are.
    """
    for lane in range(LANES):
        u = load(work, B, lane), load(work, B + 3, lane), load(work, B + 6, lane)
        v = load(work, V, lane), load(work, V + 3, lane), load(work, V + 6, lane)
        _compose(u, v, load(sigma, at_sigma, lane), p, at_p, lane, keep[lane] != 0.0)
