"""Tetrahedra that keep their volume: det F within a range (Bouaziz et al. 2014, 5.1).

The set of such F is unbounded: a tetrahedron may become as long and thin as it likes, so that
the projections have no bound.
"""

from typing import Literal

import numpy as np

from pdrom.model.constraints import products, svd3
from pdrom.model.constraints.lanes import (
    LANES,
    cross,
    dot,
    lane_function,
    load,
    load_matrix,
    save,
    save_matrix,
    unmarked,
)
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.constraints.simplex import F, P
from pdrom.model.constraints.singular_values import (
    StrainConfig,
    accumulate,
    project,
    project_gradients,
)
from pdrom.model.constraints.svd3 import FOUND, SIGMA
from pdrom.model.constraints.tetrahedron import TetrahedronGroup, forces, gradients

# where the working array of products begins
VALUES, WORK = svd3.SIZE, svd3.SIZE + products.SIZE


@lane_function
def _nearest(work, low, high):
    """Projections of a block; a lane whose det F is in the range keeps its F."""
    for lane in range(LANES):
        f0, f1, f2 = load_matrix(work, F, lane)
        volume = dot(f0, cross(f1, f2))
        save_matrix(work, P, lane, (f0, f1, f2))
        work[FOUND * LANES + lane] = 1.0 if volume >= low and volume <= high else 0.0
    if unmarked(work, FOUND) == 0.0:
        return
    svd3.factor_block(work)
    values = work[VALUES * LANES :]
    for lane in range(LANES):
        save(values, products.VALUES, lane, load(work, SIGMA, lane))
    products.nearest_block(values, low, high, True)
    for lane in range(LANES):
        save(work, SIGMA, lane, load(values, products.VALUES, lane))
    svd3.compose_block(work)


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
