"""Compiled singular value decomposition, with signed values, of blocks of 3 x 3 matrices.

One-sided Jacobi (Hestenes 1958; Demmel and Veselic 1992): rotations V make the columns of B = F V
orthogonal, and their norms are the singular values. F^T F is never formed, so that small singular
values and their directions keep their relative accuracy. Matrices are stored as S q = F^T: vector k
of a matrix is column k of F. See module `lanes` for the layout of blocks.
"""

import numpy as np

from pdrom.model.constraints import lanes, simplex
from pdrom.model.constraints.lanes import LANES, absolute_sum, choose, dot, load, mix, save, scaled

SWEEPS = 12
# two columns count as orthogonal if the cosine of their angle is below this
ORTHOGONAL = 1e-15
# a sweep is the last if all its rotations have a tangent below this: columns are then orthogonal
LAST_TANGENT = 1e-8
# a second singular value below this fraction of the first is a rounding error: replace its vector
RANK = 1e-15

# further offsets in the working array: B = F V / scale, V, scale, DONE (1: B is orthogonal), signed
# singular values, FOUND (1: a faster method has already computed this lane's projection)
B, V, SCALE, DONE, SIGMA, FOUND, SIZE = np.add(simplex.SIZE, [0, 9, 18, 19, 20, 23, 24]).tolist()


@lanes.lane_function
def jacobi_rotation(a, b, done):
    """Return cosine, sine and |tangent| of the rotation that makes columns a and b orthogonal.

    The rotation is the identity if the lane is ``done``.
    """
    alpha, beta, gamma = dot(a, a), dot(b, b), dot(a, b)
    half = 0.5 * (beta - alpha)
    root = abs(half) + np.sqrt(half * half + gamma * gamma)
    idle = done or gamma * gamma <= ORTHOGONAL * ORTHOGONAL * alpha * beta or root == 0.0
    tangent = 0.0 if idle else gamma / root
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = cosine * tangent
    return cosine, -sine if half < 0.0 else sine, abs(tangent)


@lanes.lane_function
def _sweep(work):
    """Rotate each pair of columns once; return how many matrices need a further sweep."""
    for lane in range(LANES):
        b0, b1, b2 = lanes.load_matrix(work, B, lane)
        v0, v1, v2 = lanes.load_matrix(work, V, lane)
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
        lanes.save_matrix(work, B, lane, (b0, b1, b2))
        lanes.save_matrix(work, V, lane, (v0, v1, v2))
        more = 1.0 if t01 > LAST_TANGENT or t02 > LAST_TANGENT or t12 > LAST_TANGENT else 0.0
        work[DONE * LANES + lane] = 1.0 - more
    return lanes.unmarked(work, DONE)


@lanes.lane_function
def _larger_first(a, v, b, w):
    """Return (a, v, b, w), or (b, w, -a, -v) if column b of B = F V is longer than column a.

    v and w are the columns of V that belong to a and b. Due to the sign, V stays a rotation.
    """
    swap = dot(a, a) < dot(b, b)
    return (
        choose(swap, b, a),
        choose(swap, w, v),
        choose(swap, scaled(-1.0, a), b),
        choose(swap, scaled(-1.0, v), w),
    )


@lanes.lane_function
def orthonormal_pair(b0, b1):
    """Return directions and norms (u0, u1, s0, s1) of orthogonal columns ``b0``, ``b1``.

    ``b0`` is the longer column. A zero column gets a fixed direction orthogonal to the other one.
    """
    s0 = np.sqrt(dot(b0, b0))
    u0 = choose(s0 > 0.0, scaled(1.0 / s0, b0), (1.0, 0.0, 0.0))
    # remove from b1 rounding errors along b0, which would change the direction of the shorter b1
    b1 = mix(1.0, b1, -dot(u0, b1), u0)
    s1 = np.sqrt(dot(b1, b1))
    u1 = choose(s1 > RANK * s0, scaled(1.0 / s1, b1), lanes.perpendicular(u0))
    return u0, u1, s0, s1


@lanes.lane_function
def rotated_pair(f0, f1, sign):
    """Decompose two columns into singular values and vectors by one rotation, not forming F^T F.

    Return the scale by which columns are divided, cosine and sine of the rotation, whether rotated
    columns were swapped because the second is longer, and their directions and norms (divided by
    the scale), longer column first. After a swap the shorter column is multiplied by ``sign``.
    """
    scale = absolute_sum(f0) + absolute_sum(f1) + lanes.SMALLEST
    f0, f1 = scaled(1.0 / scale, f0), scaled(1.0 / scale, f1)
    c, s, _ = jacobi_rotation(f0, f1, False)
    a, b = mix(c, f0, -s, f1), mix(s, f0, c, f1)
    swapped = dot(a, a) < dot(b, b)
    pair = orthonormal_pair(choose(swapped, b, a), choose(swapped, scaled(sign, a), b))
    return scale, c, s, swapped, pair


@lanes.lane_function
def factor_block(work):
    """Write U to `B`, V to `V` and the signed singular values of F, largest first, to `SIGMA`.

    Elements with `FOUND` = 1, whose projection is already known, get meaningless results.
    """
    for lane in range(LANES):
        f0, f1, f2 = lanes.load_matrix(work, simplex.F, lane)
        scale = absolute_sum(f0) + absolute_sum(f1) + absolute_sum(f2) + lanes.SMALLEST
        b = scaled(1.0 / scale, f0), scaled(1.0 / scale, f1), scaled(1.0 / scale, f2)
        lanes.save_matrix(work, B, lane, b)
        lanes.save_matrix(work, V, lane, ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
        work[SCALE * LANES + lane] = scale
        work[DONE * LANES + lane] = work[FOUND * LANES + lane]
    for _ in range(SWEEPS):
        if _sweep(work) == 0.0:
            break
    for lane in range(LANES):
        b0, b1, b2 = lanes.load_matrix(work, B, lane)
        v0, v1, v2 = lanes.load_matrix(work, V, lane)
        b0, v0, b1, v1 = _larger_first(b0, v0, b1, v1)
        b1, v1, b2, v2 = _larger_first(b1, v1, b2, v2)
        b0, v0, b1, v1 = _larger_first(b0, v0, b1, v1)
        u0, u1, s0, s1 = orthonormal_pair(b0, b1)
        # U has det +1, so that the last singular value takes the sign of det F (Irving et al. 2004)
        u2 = lanes.cross(u0, u1)
        lanes.save_matrix(work, B, lane, (u0, u1, u2))
        lanes.save_matrix(work, V, lane, (v0, v1, v2))
        save(work, SIGMA, lane, scaled(work[SCALE * LANES + lane], (s0, s1, dot(u2, b2))))


@lanes.lane_function
def compose_block(work):
    """Write U diag(sigma) V^T of `factor_block` to P, unless an element's P is known (`FOUND`)."""
    for lane in range(LANES):
        u, v = lanes.load_matrix(work, B, lane), lanes.load_matrix(work, V, lane)
        sigma, found = load(work, SIGMA, lane), work[FOUND * LANES + lane] != 0.0
        u0, u1, u2 = scaled(sigma[0], u[0]), scaled(sigma[1], u[1]), scaled(sigma[2], u[2])
        for i in range(3):
            place = simplex.P + 3 * i
            column = lanes.mix3(v[0][i], u0, v[1][i], u1, v[2][i], u2)
            save(work, place, lane, choose(found, load(work, place, lane), column))
