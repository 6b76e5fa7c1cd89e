"""Triangles that keep their area: the product of F's singular values within a range.

What Bouaziz et al. 2014, 5.1, do for volumes, in the plane of each triangle. The set of such F is
unbounded, see module `volume`.
"""

from typing import Literal

import numpy as np

from pdrom.model.constraints import products
from pdrom.model.constraints.lanes import LANES, lane_function, load, mix, save, scaled
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.constraints.simplex import SIZE, F, P
from pdrom.model.constraints.singular_values import (
    StrainConfig,
    accumulate,
    project,
    project_gradients,
)
from pdrom.model.constraints.svd3 import rotated_pair
from pdrom.model.constraints.triangle_strain import TriangleStrain, forces, gradients

# numbers of a lane after those of every simplex: the columns of U, the rotation V, the values
U, COSINE, SINE = SIZE, SIZE + 6, SIZE + 7
VALUES = SIZE + 8
WORK = VALUES + products.SIZE


@lane_function
def _nearest(work, low, high):
    """Projections of a block."""
    values = work[VALUES * LANES :]
    for lane in range(LANES):
        f0, f1 = load(work, F, lane), load(work, F + 3, lane)
        scale, c, s, swapped, pair = rotated_pair(f0, f1, -1.0)
        u0, u1, s0, s1 = pair
        save(work, U, lane, u0)
        save(work, U + 3, lane, u1)
        # a quarter turn more puts the longer column first
        work[COSINE * LANES + lane] = s if swapped else c
        work[SINE * LANES + lane] = -c if swapped else s
        save(values, products.VALUES, lane, (scale * s0, 1.0, scale * s1))
    products.nearest_block(values, low, high, False)
    for lane in range(LANES):
        sigma = load(values, products.VALUES, lane)
        a, b = scaled(sigma[0], load(work, U, lane)), scaled(sigma[2], load(work, U + 3, lane))
        c, s = work[COSINE * LANES + lane], work[SINE * LANES + lane]
        save(work, P, lane, mix(c, a, s, b))
        save(work, P + 3, lane, mix(c, b, -s, a))


@local_kernel
def _project(y, p, record, part):
    return project(y, p, record, part, 2, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record, part):
    return accumulate(y, rhs, record, part, 2, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    project_gradients(d, allowed, p, m, 2, WORK, _nearest)


class TriangleArea(TriangleStrain):
    """One constraint per triangle on its area over that at rest, weight w A_t."""

    class Config(StrainConfig):
        """Weight w per area, N/m; allowed areas [minimum, maximum] over that at rest."""

        effect: Literal["area"] = "area"

    work_size = WORK
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients
    manifold = "size"

    def _reference_values(self, sigma: np.ndarray) -> np.ndarray:
        return products.reference_nearest(sigma, *self.allowed)
