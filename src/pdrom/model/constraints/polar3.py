"""The cheap cases of 3 x 3 projections, for blocks of matrices.

X <- (X + X^-T) / 2 converges quadratically to the orthogonal polar factor (Higham 1986). It serves
matrices far from singular with positive determinant; module `svd3` does the others. A
matrix whose singular values lie in the range already is its own projection.
"""

import numpy as np

from pdrom.model.constraints.lanes import (
    LANES,
    SMALLEST,
    choose,
    cross,
    dot,
    lane_function,
    load,
    mix,
    save,
    scaled,
    square_distance,
)

STEPS = 16
# det F relative to the cube of the root mean square of the singular values: below it the SVD
# takes over
WELL_CONDITIONED = 1e-2
# square of a Newton step: quadratic convergence, a step of 1e-9 leaves an error of 1e-18
LAST_STEP = 1e-18

_OPEN, _FOUND, _UNSUITED = 0.0, 1.0, 2.0


@lane_function
def _newton_step(x0, x1, x2):
    c0, c1, c2 = cross(x1, x2), cross(x2, x0), cross(x0, x1)
    inverse = 0.5 / dot(x0, c0)
    return mix(0.5, x0, inverse, c0), mix(0.5, x1, inverse, c1), mix(0.5, x2, inverse, c2)


@lane_function
def _start(f, at_f, p, at_p, state):
    for lane in range(LANES):
        f0, f1, f2 = load(f, at_f, lane), load(f, at_f + 3, lane), load(f, at_f + 6, lane)
        square = (dot(f0, f0) + dot(f1, f1) + dot(f2, f2)) / 3.0
        inverse = 1.0 / np.sqrt(square)
        # scaled before the determinant, whose products would overflow; where the mean itself does,
        # or vanishes, F is not suited
        x0, x1, x2 = scaled(inverse, f0), scaled(inverse, f1), scaled(inverse, f2)
        suited = square > SMALLEST and dot(x0, cross(x1, x2)) > WELL_CONDITIONED
        save(p, at_p, lane, x0)
        save(p, at_p + 3, lane, x1)
        save(p, at_p + 6, lane, x2)
        state[lane] = _OPEN if suited else _UNSUITED


@lane_function
def _advance(p, at_p, state):
    """One Newton step of the lanes that still iterate; the others keep their bits."""
    for lane in range(LANES):
        x0, x1, x2 = load(p, at_p, lane), load(p, at_p + 3, lane), load(p, at_p + 6, lane)
        n0, n1, n2 = _newton_step(x0, x1, x2)
        step = square_distance(n0, x0) + square_distance(n1, x1) + square_distance(n2, x2)
        is_open = state[lane] == _OPEN
        save(p, at_p, lane, choose(is_open, n0, x0))
        save(p, at_p + 3, lane, choose(is_open, n1, x1))
        save(p, at_p + 6, lane, choose(is_open, n2, x2))
        state[lane] = _FOUND if is_open and step < LAST_STEP else state[lane]


@lane_function
def rotation_block(f, at_f, p, at_p, found):
    """Write the nearest rotations of the suited matrices to P.

    Parameters
    ----------
    f, at_f, p, at_p : blocks of matrices and the number at which F and P begin in them
    found : (LANES,) set to 1 where P is the rotation and to 0 where F is not suited
    """
    _start(f, at_f, p, at_p, found)
    for _ in range(STEPS):
        _advance(p, at_p, found)
        open_lanes = 0.0
        for lane in range(LANES):
            open_lanes += 1.0 if found[lane] == _OPEN else 0.0
        if open_lanes == 0.0:
            break
    for lane in range(LANES):
        found[lane] = 1.0 if found[lane] == _FOUND else 0.0


@lane_function
def within_range_block(f, at_f, p, at_p, low, high, found):
    """Copy F to P, and set ``found`` to 1 where its singular values surely lie in the range.

    F and P begin at the numbers ``at_f`` of ``f`` and ``at_p`` of ``p``; the range is [low, high].

    Sufficient: |F^T F - I|_F bounds the distance of every squared singular value from 1, and
    det F > 0.
    """
    slack = min(1.0 - low * low, high * high - 1.0)
    for lane in range(LANES):
        f0, f1, f2 = load(f, at_f, lane), load(f, at_f + 3, lane), load(f, at_f + 6, lane)
        g0, g1, g2 = dot(f0, f0) - 1.0, dot(f1, f1) - 1.0, dot(f2, f2) - 1.0
        h0, h1, h2 = dot(f1, f2), dot(f2, f0), dot(f0, f1)
        distance = g0 * g0 + g1 * g1 + g2 * g2 + 2.0 * (h0 * h0 + h1 * h1 + h2 * h2)
        inside = distance < slack * slack and dot(f0, cross(f1, f2)) > 0.0
        save(p, at_p, lane, f0)
        save(p, at_p + 3, lane, f1)
        save(p, at_p + 6, lane, f2)
        found[lane] = 1.0 if inside else 0.0
