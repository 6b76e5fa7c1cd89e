"""Triangles that keep their area: the product of F's singular values within a range.

What Bouaziz et al. 2014, 5.1, do for volumes, in the plane of each triangle. The set of such F is
unbounded, see module `volume` beside.
"""

from typing import Literal

import numpy as np

from pdrom.model.compiled.rows import doubles
from pdrom.model.constraints import products
from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    SMALLEST,
    absolute_sum,
    choose,
    dot,
    lane_function,
    load,
    mix,
    save,
    scaled,
    take,
)
from pdrom.model.constraints.local_kernel import local_kernel
from pdrom.model.constraints.simplex import (
    SIZE,
    F,
    P,
    arguments,
    copy_rows,
    energy,
    gather_edges,
    samples,
    scatter,
    start_energy,
    store_projections,
)
from pdrom.model.constraints.svd3 import jacobi_rotation, orthonormal_pair
from pdrom.model.constraints.triangle_strain import (
    GEOMETRY,
    StrainConfig,
    TriangleStrain,
    forces,
    gradients,
)

# numbers of a lane after those of every simplex: the columns of U, the rotation V, the values
U, COSINE, SINE = SIZE, SIZE + 6, SIZE + 7
VALUES = SIZE + 8
ALL = VALUES + products.SIZE


@lane_function
def _factors(work, values):
    """Leave U, V and the singular values of a block, the larger first."""
    for lane in range(LANES):
        f0, f1 = load(work, F, lane), load(work, F + 3, lane)
        scale = absolute_sum(f0) + absolute_sum(f1) + SMALLEST
        f0, f1 = scaled(1.0 / scale, f0), scaled(1.0 / scale, f1)
        c, s, _ = jacobi_rotation(f0, f1, False)
        a, b = mix(c, f0, -s, f1), mix(s, f0, c, f1)
        # a quarter turn more puts the longer column first
        swapped = dot(a, a) < dot(b, b)
        u0, u1, s0, s1 = orthonormal_pair(
            choose(swapped, b, a), choose(swapped, scaled(-1.0, a), b)
        )
        save(work, U, lane, u0)
        save(work, U + 3, lane, u1)
        work[COSINE * LANES + lane] = s if swapped else c
        work[SINE * LANES + lane] = -c if swapped else s
        save(values, products.VALUES, lane, (scale * s0, 1.0, scale * s1))


@lane_function
def _nearest(work, low, high):
    """Projections of a block."""
    values = work[VALUES * LANES :]
    _factors(work, values)
    products.nearest_block(values, low, high, False)
    for lane in range(LANES):
        sigma = load(values, products.VALUES, lane)
        a, b = scaled(sigma[0], load(work, U, lane)), scaled(sigma[2], load(work, U + 3, lane))
        c, s = work[COSINE * LANES + lane], work[SINE * LANES + lane]
        save(work, P, lane, mix(c, a, s, b))
        save(work, P + 3, lane, mix(c, b, -s, a))


@local_kernel
def _project(y_place, p_place, record, part):
    y, _, corners, geometry, allowed, work, _, _ = arguments(
        y_place, p_place, record, part, 3, GEOMETRY
    )
    elements, taken, taken_geometry = samples(record, 3, GEOMETRY)
    p = doubles(p_place, 3 * 2 * len(elements))
    low, high = allowed[0], allowed[1]
    for start in range(0, len(elements), LANES):
        take(corners, 3, elements, start, taken)
        take(geometry, GEOMETRY, elements, start, taken_geometry)
        gather_edges(y, taken, 0, 2, work)
        gradients(work, taken_geometry, 0)
        _nearest(work, low, high)
        store_projections(work, 2, start, p)
    return 0.0


@local_kernel
def _accumulate(y_place, rhs_place, record, part):
    y, rhs, corners, geometry, allowed, work, first, last = arguments(
        y_place, rhs_place, record, part, 3, GEOMETRY
    )
    low, high = allowed[0], allowed[1]
    start_energy(work)
    for block in range(first, last):
        gather_edges(y, corners, block, 2, work)
        gradients(work, geometry, block)
        _nearest(work, low, high)
        forces(work, geometry, block)
        scatter(work, corners, block, 2, rhs)
    return energy(work)


@gradient_kernel
def _project_gradients(d_pointer, range_pointer, p_pointer, m):
    d, p = carray(d_pointer, (2 * m, 3)), carray(p_pointer, (6 * m,))
    allowed = carray(range_pointer, (2,))
    work = np.zeros(ALL * LANES)
    for start in range(0, m, LANES):
        copy_rows(d, 2, start, work, F)
        _nearest(work, allowed[0], allowed[1])
        store_projections(work, 2, start, p)


class TriangleArea(TriangleStrain):
    """One constraint per triangle on its area over that at rest, weight w A_t."""

    class Config(StrainConfig):
        """Weight w per area, N/m; allowed areas [minimum, maximum] over that at rest."""

        effect: Literal["area"] = "area"

    work_size = ALL
    project_kernel = _project
    accumulate_kernel = _accumulate
    manifold = "size"

    @property
    def gradient_kernel(self):
        return _project_gradients

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d, full_matrices=False)
        nearest = products.reference_nearest(sigma, self.config.minimum, self.config.maximum)
        return (u * nearest[:, None, :]) @ vt
