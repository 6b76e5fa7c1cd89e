"""Tetrahedra that keep their volume: det F within a range (Bouaziz et al. 2014, 5.1).

The set of such F is unbounded: a tetrahedron may become as long and thin as it likes, so that
the projections have no bound.
"""

from typing import Literal

import numpy as np

from pdrom.model.constraints import products, svd3
from pdrom.model.constraints.lanes import LANES, cross, dot, lane_function, load, save
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.constraints.simplex import SIZE, F, P
from pdrom.model.constraints.singular_values import (
    StrainConfig,
    accumulate,
    project,
    project_gradients,
)
from pdrom.model.constraints.tetrahedron import TetrahedronGroup, forces, gradients

# where the working arrays of svd3 and products and the marks of finished lanes begin
SVD = SIZE
VALUES = SVD + svd3.FACTORS
FOUND = VALUES + products.SIZE
WORK = FOUND + 1


@lane_function
def _within_range(work, low, high):
    """Copy F to P and mark it where det F is in the range; return how many lanes are left."""
    left = 0.0
    for lane in range(LANES):
        f0, f1, f2 = load(work, F, lane), load(work, F + 3, lane), load(work, F + 6, lane)
        volume = dot(f0, cross(f1, f2))
        inside = volume >= low and volume <= high
        save(work, P, lane, f0)
        save(work, P + 3, lane, f1)
        save(work, P + 6, lane, f2)
        work[FOUND * LANES + lane] = 1.0 if inside else 0.0
        left += 0.0 if inside else 1.0
    return left


@lane_function
def _nearest(work, low, high):
    """Projections of a block."""
    if _within_range(work, low, high) == 0.0:
        return
    found, factors = work[FOUND * LANES :], work[SVD * LANES :]
    values = work[VALUES * LANES :]
    svd3.factor_block(work, F, found, factors)
    for lane in range(LANES):
        save(values, products.VALUES, lane, load(factors, svd3.SIGMA, lane))
    products.nearest_block(values, low, high, True)
    svd3.compose_block(values, products.VALUES, work, P, found, factors)


@local_kernel
def _project(y, p, record, part):
    return project(y, p, record, part, 3, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record, part):
    return accumulate(y, rhs, record, part, 3, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    project_gradients(d, allowed, p, m, 3, WORK, _nearest)


class TetrahedronVolume(TetrahedronGroup):
    """One constraint per tetrahedron on det F, its volume over that at rest; weight w V_t.

    An inverted tetrahedron is turned right side out.
    """

    class Config(StrainConfig):
        """Weight w per volume, N/m^2; allowed volumes [minimum, maximum] over that at rest."""

        effect: Literal["volume"] = "volume"

    work_size = WORK
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients
    manifold = "size"

    def _reference_values(self, sigma: np.ndarray) -> np.ndarray:
        return products.reference_nearest(sigma, *self.allowed)
