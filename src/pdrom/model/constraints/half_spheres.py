"""Kernels of vertex bending: the nearest point of a half sphere to the curvature vector."""

import numpy as np
from numba import carray

from pdrom.model.compiled import arithmetic, rows
from pdrom.model.compiled.rows import WIDTH, at
from pdrom.model.constraints.gradient_kernel import gradient_kernel
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
    take,
)
from pdrom.model.constraints.local_kernel import FIRST, OWN, VERTICES, local_kernel

# A rim direction below this has been lost to round-off.
RIM = 1e-15
# A rim direction above this is at right angles to the normal up to 2e-12; below, the difference
# that it comes from has cancelled so far that it is made orthogonal once more.
NEAR_POLE = 1e-4

# numbers of a lane in the packed manifold: weight, magnitude, rest curvature, side times normal
WEIGHT, MAGNITUDE, REST, POLE, MANIFOLD = 0, 1, 2, 5, 8
# and in the working array: curvature, p, height of its direction above the equator
H, P, HEIGHT, SIZE = 0, 3, 6, 7
# Entries of the record: the numbers of elements and of those to project; then the places of the
# operator in CSR, the manifold, the working arrays, the elements to project and their manifold.
ELEMENTS, COUNT, START, INDICES, DATA, SPHERES, WORK, SAMPLED, TAKEN, ARRAYS = range(OWN, OWN + 10)


@kernel
def put_poles(manifold, elements, side, normals):
    """Write ``side`` (m,) times ``normals`` (m, 3) of some elements to the packed ``manifold``."""
    for e in elements:
        place = (e // LANES * MANIFOLD + POLE) * LANES + e % LANES
        save(manifold, 0, place, scaled(side[e], (normals[e, 0], normals[e, 1], normals[e, 2])))


@lane_function
def _curvature(y, e, start, indices, data):
    """Mean-curvature vector of element e."""
    h = arithmetic.constant(0.0)
    for k in range(at(start, e), at(start, e + 1)):
        h = arithmetic.add_scaled(h, at(data, k), rows.load(y, WIDTH * at(indices, k)))
    return h


@lane_function
def _save_columns(work, first, lane, a, b, c, d):
    """Save the vectors of four lanes."""
    x, y, z, _ = arithmetic.transposed(a, b, c, d)
    place = first * LANES + lane
    rows.store(work, place, x)
    rows.store(work, place + LANES, y)
    rows.store(work, place + 2 * LANES, z)


@lane_function
def _without(a, part, n):
    """Direction and length of a - part n."""
    rest = mix(1.0, a, -part, n)
    length = np.sqrt(dot(rest, rest))
    return scaled(1.0 / length, rest), length


@lane_function
def _half_spheres(work, manifold, block):
    """Nearest points of the half spheres to the curvature vectors of a block."""
    first, wrong = block * MANIFOLD, 0.0
    for lane in range(LANES):
        h, n = load(work, H, lane), load(manifold, first + POLE, lane)
        # scaled: neither overflow nor underflow of the squares
        scale = absolute_sum(h)
        unit = scaled(1.0 / (scale + SMALLEST), h)
        unit = scaled(1.0 / np.sqrt(dot(unit, unit)), unit)
        save(work, P, lane, unit)
        work[HEIGHT * LANES + lane] = dot(unit, n)
    for lane in range(LANES):
        wrong += 1.0 if work[HEIGHT * LANES + lane] < 0.0 else 0.0
    if wrong > 0.0:
        _to_rims(work, manifold, first)
    for lane in range(LANES):
        n, unit = load(manifold, first + POLE, lane), load(work, P, lane)
        magnitude = at(manifold, (first + MAGNITUDE) * LANES + lane)
        pole = choose(dot(n, n) == 0.0, load(manifold, first + REST, lane), scaled(magnitude, n))
        vanishes = absolute_sum(load(work, H, lane)) == 0.0
        save(work, P, lane, choose(vanishes, pole, scaled(magnitude, unit)))


@lane_function
def _to_rims(work, manifold, first):
    """Replace the directions on the wrong side by those of the rim."""
    for lane in range(LANES):
        n, unit = load(manifold, first + POLE, lane), load(work, P, lane)
        height = work[HEIGHT * LANES + lane]
        rim, length = _without(unit, height, n)
        again, left = _without(rim, dot(rim, n), n)
        # what is mostly normal after a difference of unit vectors was round-off from the start
        again = choose(length > RIM and left > 0.5, again, perpendicular(n))
        rim = choose(length > NEAR_POLE, rim, again)
        save(work, P, lane, choose(height < 0.0, rim, unit))


@lane_function
def _operator(y_place, record):
    """(y, operator in CSR) of a kernel."""
    entries = rows.indices(record, ARRAYS)
    y = rows.doubles(y_place, WIDTH * entries[VERTICES])
    start = rows.integers(entries[START], entries[ELEMENTS] + 1)
    count = at(start, entries[ELEMENTS])
    return y, start, rows.integers(entries[INDICES], count), rows.doubles(entries[DATA], count)


@lane_function
def _spheres(record, part):
    """(manifold, working array) of a kernel."""
    entries = rows.indices(record, ARRAYS)
    return (
        rows.doubles(entries[SPHERES], entries[FIRST + 2] * MANIFOLD * LANES),
        rows.doubles(entries[WORK] + 8 * SIZE * LANES * part, SIZE * LANES),
    )


@local_kernel
def project_vertices(y_place, p_place, record, part):
    """Projections (m, 3) of some elements; the arguments are those of `local_kernel`.

    Addresses: ``y_place``, ``p_place``, ``record``; ``part`` says which working array is used.
    """
    y, start, indices, data = _operator(y_place, record)
    manifold, work = _spheres(record, part)
    entries = rows.indices(record, ARRAYS)
    count = entries[COUNT]
    elements = rows.indices(entries[SAMPLED], count)
    taken = rows.doubles(entries[TAKEN], MANIFOLD * LANES)
    p = rows.doubles(p_place, 3 * count)
    for begin in range(0, count, LANES):
        for lane in range(LANES):
            e = elements[min(begin + lane, count - 1)]
            save(work, H, lane, arithmetic.first_three(_curvature(y, e, start, indices, data)))
        take(manifold, MANIFOLD, elements, begin, taken)
        _half_spheres(work, taken, 0)
        for lane in range(min(LANES, count - begin)):
            i = 3 * (begin + lane)
            p[i], p[i + 1], p[i + 2] = load(work, P, lane)
    return 0.0


@local_kernel
def accumulate_vertices(y_place, rhs_place, record, part):
    """Add S^T W p of a part's blocks to the right-hand side; their energy.

    ``y_place``, ``rhs_place`` and ``record`` are addresses, see `local_kernel`.
    """
    entries = rows.indices(record, ARRAYS)
    y, start, indices, data = _operator(y_place, record)
    manifold, work = _spheres(record, part)
    rhs, elements = rows.doubles(rhs_place, WIDTH * entries[VERTICES]), entries[ELEMENTS]
    energy = 0.0
    for block in range(entries[FIRST + part], entries[FIRST + part + 1]):
        begin = block * LANES
        used = min(LANES, elements - begin)
        for lane in range(0, used, WIDTH):
            e, last = begin + lane, elements - 1
            _save_columns(
                work, H, lane,
                _curvature(y, e, start, indices, data),
                _curvature(y, min(e + 1, last), start, indices, data),
                _curvature(y, min(e + 2, last), start, indices, data),
                _curvature(y, min(e + 3, last), start, indices, data),
            )  # fmt: skip
        _half_spheres(work, manifold, block)
        for lane in range(used):
            w = at(manifold, (block * MANIFOLD + WEIGHT) * LANES + lane)
            h, p = load(work, H, lane), load(work, P, lane)
            energy += w * square_distance(h, p)
            force = arithmetic.of_three(w * p[0], w * p[1], w * p[2])
            for k in range(at(start, begin + lane), at(start, begin + lane + 1)):
                v = WIDTH * at(indices, k)
                rows.store(rhs, v, arithmetic.add_scaled(rows.load(rhs, v), at(data, k), force))
    return 0.5 * energy


@gradient_kernel
def project_gradients(d_pointer, manifold_pointer, p_pointer, m):
    """Projections (m, 3) from S q (m, 3) and the packed manifold.

    They lie at ``p_pointer``, ``d_pointer`` and ``manifold_pointer``, see `gradient_kernel`.
    """
    d, p = carray(d_pointer, (m, 3)), carray(p_pointer, (m, 3))
    blocks = (m + LANES - 1) // LANES
    manifold = carray(manifold_pointer, (blocks * MANIFOLD * LANES,))
    work = np.zeros(SIZE * LANES)
    for block in range(blocks):
        for lane in range(LANES):
            e = min(block * LANES + lane, m - 1)
            save(work, H, lane, (d[e, 0], d[e, 1], d[e, 2]))
        _half_spheres(work, manifold, block)
        for lane in range(min(LANES, m - block * LANES)):
            i = block * LANES + lane
            p[i, 0], p[i, 1], p[i, 2] = load(work, P, lane)
