"""Compiled 3 x 2 projection: singular values clamped to a range, for blocks of matrices.

The singular values of F are the roots of the eigenvalues m +- h of F^T F, and the nearest matrix is
F (g_1 v_1 v_1^T + g_2 v_2 v_2^T) with g_i = clamp(sigma_i) / sigma_i, where v_1 v_1^T - v_2 v_2^T
is the traceless part of F^T F over h: no direction is ever computed. It serves matrices that are
not nearly flat; their smaller singular value comes from the cross product of the columns, which
does not cancel. The others are rotated by a one-sided Jacobi rotation (module `svd3`). Matrices are
stored as in S q = F^T: vector k of a matrix is column k of F. See module `lanes` for the layout.
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
    save,
    scaled,
)
from pdrom.model.constraints.svd3 import jacobi_rotation, orthonormal_pair

# sigma_1 sigma_2 over the mean of their squares: below it a matrix is nearly flat
FLAT = 1e-2
# means of the squares whose powers in the closed form neither overflow nor lose digits
LOW, HIGH = 1e-60, 1e60
# added to h in units of m: where sigma_1 = sigma_2 up to round-off there is nothing to tell apart
EQUAL = 1e-17


@lane_function
def _closed_form(f0, f1, low, high):
    """Nearest matrix, and whether the closed form suits F: where not, the matrix is meaningless."""
    a, b, off = dot(f0, f0), dot(f1, f1), dot(f0, f1)
    mean, half = 0.5 * (a + b), 0.5 * (a - b)
    h = np.sqrt(half * half + off * off) + EQUAL * mean
    normal = cross(f0, f1)
    product = np.sqrt(dot(normal, normal))
    large = np.sqrt(mean + h)
    # one division for the three reciprocals
    inverse = 1.0 / (large * product * h)
    of_large, of_product, of_h = (
        inverse * product * h,
        inverse * large * h,
        inverse * large * product,
    )
    first = clamp(large, low, high) * of_large
    second = clamp(product * of_large, low, high) * (large * of_product)
    middle, slope = 0.5 * (first + second), 0.5 * (first - second) * of_h
    suited = mean > LOW and mean < HIGH and product > FLAT * mean
    p0 = mix(middle + slope * half, f0, slope * off, f1)
    p1 = mix(slope * off, f0, middle - slope * half, f1)
    return p0, p1, suited


@lane_function
def _rotated(f0, f1, low, high):
    """Nearest matrix by one rotation that makes the columns orthogonal.

    Their norms are the singular values. Working on F, not on F^T F, keeps small singular values
    accurate.
    """
    scale = absolute_sum(f0) + absolute_sum(f1) + SMALLEST
    f0, f1 = scaled(1.0 / scale, f0), scaled(1.0 / scale, f1)
    c, s, _ = jacobi_rotation(f0, f1, False)
    a, b = mix(c, f0, -s, f1), mix(s, f0, c, f1)
    swapped = dot(a, a) < dot(b, b)
    u0, u1, s0, s1 = orthonormal_pair(choose(swapped, b, a), choose(swapped, a, b))
    # not finite where F is not
    u0 = scaled(clamp(scale * s0, low, high) + 0.0 * scale, u0)
    u1 = scaled(clamp(scale * s1, low, high), u1)
    a, b = choose(swapped, u1, u0), choose(swapped, u0, u1)
    return mix(c, a, s, b), mix(c, b, -s, a)


@lane_function
def clamp_block(work, at_f, at_p, at_found, low, high):
    """Write the matrices nearest to F with singular values in [low, high] to P, in ``work``.

    at_f, at_p, at_found : numbers of the working array at which F, P and marks of the lanes begin

    A matrix with an entry that is not finite gives nan.
    """
    left = 0.0
    for lane in range(LANES):
        p0, p1, suited = _closed_form(load(work, at_f, lane), load(work, at_f + 3, lane), low, high)
        save(work, at_p, lane, p0)
        save(work, at_p + 3, lane, p1)
        work[at_found * LANES + lane] = 1.0 if suited else 0.0
    for lane in range(LANES):
        left += 1.0 - work[at_found * LANES + lane]
    if left > 0.0:
        for lane in range(LANES):
            found = work[at_found * LANES + lane] != 0.0
            p0, p1 = _rotated(load(work, at_f, lane), load(work, at_f + 3, lane), low, high)
            save(work, at_p, lane, choose(found, load(work, at_p, lane), p0))
            save(work, at_p + 3, lane, choose(found, load(work, at_p + 3, lane), p1))
