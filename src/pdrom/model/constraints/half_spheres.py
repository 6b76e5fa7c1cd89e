"""Kernels of vertex bending: the nearest point of a half sphere to the curvature vector."""

import numpy as np

from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    SMALLEST,
    absolute_sum,
    choose,
    dot,
    kernel,
    lane_function,
    load,
    mix,
    perpendicular,
    save,
    scaled,
    square_distance,
)

# A rim direction below this has been lost to round-off.
RIM = 1e-15
# A rim direction above this is at right angles to the normal up to 2e-12; below, the difference
# that it comes from has cancelled so far that it is made orthogonal once more.
NEAR_POLE = 1e-4

# numbers of a lane in the working array: curvature, side times normal, magnitude, p, weight,
# energy, rest curvature
H, NORMAL, MAGNITUDE, P, WEIGHT, ENERGY, REST, SIZE = 0, 3, 6, 7, 10, 11, 12, 15


@lane_function
def _gather(y, e, lane, operator, manifold, work):
    """Curvature vector and manifold of element e."""
    indptr, indices, data = operator
    rest, magnitude, side, normals, weights = manifold
    hx, hy, hz = 0.0, 0.0, 0.0
    for k in range(indptr[e], indptr[e + 1]):
        v = indices[k]
        hx += data[k] * y[v, 0]
        hy += data[k] * y[v, 1]
        hz += data[k] * y[v, 2]
    save(work, H, lane, (hx, hy, hz))
    save(work, NORMAL, lane, scaled(side[e], (normals[e, 0], normals[e, 1], normals[e, 2])))
    save(work, REST, lane, (rest[e, 0], rest[e, 1], rest[e, 2]))
    work[MAGNITUDE * LANES + lane] = magnitude[e]
    work[WEIGHT * LANES + lane] = weights[e]


@lane_function
def _without(a, part, n):
    """Direction and length of a - part n."""
    rest = mix(1.0, a, -part, n)
    length = np.sqrt(dot(rest, rest))
    return scaled(1.0 / length, rest), length


@lane_function
def _half_spheres(work):
    """Nearest points of the half spheres to the curvature vectors of a block."""
    for lane in range(LANES):
        h, n = load(work, H, lane), load(work, NORMAL, lane)
        # scaled: neither overflow nor underflow of the squares
        scale = absolute_sum(h)
        unit = scaled(1.0 / (scale + SMALLEST), h)
        unit = scaled(1.0 / np.sqrt(dot(unit, unit)), unit)
        height = dot(unit, n)
        rim, length = _without(unit, height, n)
        again, left = _without(rim, dot(rim, n), n)
        # what is mostly normal after a difference of unit vectors was round-off from the start
        again = choose(length > RIM and left > 0.5, again, perpendicular(n))
        rim = choose(length > NEAR_POLE, rim, again)
        unit = choose(height < 0.0, rim, unit)
        magnitude = work[MAGNITUDE * LANES + lane]
        pole = choose(dot(n, n) == 0.0, load(work, REST, lane), scaled(magnitude, n))
        p = choose(scale == 0.0, pole, scaled(magnitude, unit))
        save(work, P, lane, p)
        work[ENERGY * LANES + lane] = work[WEIGHT * LANES + lane] * square_distance(h, p)


@kernel
def project_vertices(y, elements, operator, manifold, work, p):
    """Projections p (m, 3) of some elements."""
    count = elements.shape[0]
    for start in range(0, count, LANES):
        for lane in range(LANES):
            _gather(y, elements[min(start + lane, count - 1)], lane, operator, manifold, work)
        _half_spheres(work)
        for lane in range(min(LANES, count - start)):
            i = start + lane
            p[i, 0], p[i, 1], p[i, 2] = load(work, P, lane)


@kernel
def accumulate_vertices(y, operator, manifold, first, last, work, rhs):
    """Add S^T W p of the elements first .. last - 1 to rhs; their energy."""
    indptr, indices, data = operator
    energy = 0.0
    for start in range(first, last, LANES):
        for lane in range(LANES):
            _gather(y, min(start + lane, last - 1), lane, operator, manifold, work)
        _half_spheres(work)
        for lane in range(min(LANES, last - start)):
            px, py, pz = scaled(work[WEIGHT * LANES + lane], load(work, P, lane))
            for k in range(indptr[start + lane], indptr[start + lane + 1]):
                v = indices[k]
                rhs[v, 0] += data[k] * px
                rhs[v, 1] += data[k] * py
                rhs[v, 2] += data[k] * pz
            energy += work[ENERGY * LANES + lane]
    return 0.5 * energy


@gradient_kernel
def project_gradients(d_pointer, manifold_pointer, p_pointer, m):
    """Projections from S q; the manifold has side times normal, magnitude and rest curvature."""
    d, p = carray(d_pointer, (m, 3)), carray(p_pointer, (m, 3))
    manifold = carray(manifold_pointer, (m, 7))
    work = np.zeros(SIZE * LANES)
    for start in range(0, m, LANES):
        for lane in range(LANES):
            e = min(start + lane, m - 1)
            save(work, H, lane, (d[e, 0], d[e, 1], d[e, 2]))
            save(work, NORMAL, lane, (manifold[e, 0], manifold[e, 1], manifold[e, 2]))
            work[MAGNITUDE * LANES + lane] = manifold[e, 3]
            save(work, REST, lane, (manifold[e, 4], manifold[e, 5], manifold[e, 6]))
        _half_spheres(work)
        for lane in range(min(LANES, m - start)):
            i = start + lane
            p[i, 0], p[i, 1], p[i, 2] = load(work, P, lane)
