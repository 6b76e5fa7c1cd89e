"""Tetrahedra that keep their volume: det F within a range (Bouaziz et al. 2014, 5.1).

The set of such F is unbounded: a tetrahedron may become as long and thin as it likes, so that no
bound on the projections exists (`pdrom.experiments.kit.boundedness`).
"""

from typing import Literal

import numpy as np

from pdrom.model.compiled.rows import doubles
from pdrom.model.constraints import products, svd3
from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import LANES, cross, dot, lane_function, load, save, take
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
from pdrom.model.constraints.tetrahedron import GEOMETRY, TetrahedronGroup, forces, gradients
from pdrom.model.constraints.triangle_strain import StrainConfig
from pdrom.model.mesh.types import Mesh

# where the working arrays of svd3 and products and the marks of finished lanes begin
SVD = SIZE
VALUES = SVD + svd3.FACTORS
FOUND = VALUES + products.SIZE
ALL = FOUND + 1


@lane_function
def _within_range(work, low, high):
    """Copy F to P and mark it where det F lies in the range; how many lanes are left."""
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
def _project(y_place, p_place, record, part):
    y, _, corners, geometry, allowed, work, _, _ = arguments(
        y_place, p_place, record, part, 4, GEOMETRY
    )
    elements, taken, taken_geometry = samples(record, 4, GEOMETRY)
    p = doubles(p_place, 3 * 3 * len(elements))
    low, high = allowed[0], allowed[1]
    for start in range(0, len(elements), LANES):
        take(corners, 4, elements, start, taken)
        take(geometry, GEOMETRY, elements, start, taken_geometry)
        gather_edges(y, taken, 0, 3, work)
        gradients(work, taken_geometry, 0)
        _nearest(work, low, high)
        store_projections(work, 3, start, p)
    return 0.0


@local_kernel
def _accumulate(y_place, rhs_place, record, part):
    y, rhs, corners, geometry, allowed, work, first, last = arguments(
        y_place, rhs_place, record, part, 4, GEOMETRY
    )
    low, high = allowed[0], allowed[1]
    start_energy(work)
    for block in range(first, last):
        gather_edges(y, corners, block, 3, work)
        gradients(work, geometry, block)
        _nearest(work, low, high)
        forces(work, geometry, block)
        scatter(work, corners, block, 3, rhs)
    return energy(work)


@gradient_kernel
def _project_gradients(d_pointer, range_pointer, p_pointer, m):
    d, p = carray(d_pointer, (3 * m, 3)), carray(p_pointer, (9 * m,))
    allowed = carray(range_pointer, (2,))
    work = np.zeros(ALL * LANES)
    for start in range(0, m, LANES):
        copy_rows(d, 3, start, work, F)
        _nearest(work, allowed[0], allowed[1])
        store_projections(work, 3, start, p)


class TetrahedronVolume(TetrahedronGroup):
    """One constraint per tetrahedron on det F, its volume over that at rest; weight w V_t.

    An inverted tetrahedron is turned right side out.
    """

    class Config(StrainConfig):
        """Weight w per volume, N/m^2; allowed volumes [minimum, maximum] over that at rest."""

        effect: Literal["volume"] = "volume"

    work_size = ALL
    project_kernel = _project
    accumulate_kernel = _accumulate
    manifold = "size"

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.minimum, self.maximum = config.minimum, config.maximum
        self._set_up(mesh)

    @property
    def gradient_kernel(self):
        return _project_gradients

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d)
        # the smallest singular value carries the sign of the determinant
        turned = np.sign(np.linalg.det(u) * np.linalg.det(vt))
        sigma[:, 2] *= turned
        u[:, :, 2] *= turned[:, None]
        nearest = products.reference_nearest(sigma, self.minimum, self.maximum)
        return (u * nearest[:, None, :]) @ vt
