"""Groups on tetrahedra: operator S q = F^T (deformation gradient) and kernels that project F.

If F is well-conditioned and det F > 0, the iteration X <- (X + X^-T) / 2 from X = F converges
quadratically to the nearest rotation (Higham 1986). Module `svd3` decomposes any other F. If all
singular values of F are in the allowed range, F is its own projection.
"""

from typing import Literal

import numpy as np

from pdrom.model.compiled.rows import at
from pdrom.model.constraints import lanes, singular_values, svd3
from pdrom.model.constraints.base import GroupConfig, require_cells
from pdrom.model.constraints.lanes import LANES, choose, cross, dot, mix, scaled, square_distance
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.constraints.simplex import EDGE, ENERGY, FORCE, OPERATOR, WEIGHT, F, P
from pdrom.model.constraints.svd3 import FOUND
from pdrom.model.mesh.types import Mesh

STEPS = 16
# the SVD replaces the iteration if det F, divided by the cube of the root mean square of the
# singular values of F, is below this
WELL_CONDITIONED = 1e-2
# the iteration ends after a step s if |s|^2, about the error of its result, is below this
LAST_STEP = 1e-18

_OPEN, _FOUND, _UNSUITED = 0.0, 1.0, 2.0


@lanes.lane_function
def _start(work):
    for lane in range(LANES):
        f0, f1, f2 = lanes.load_matrix(work, F, lane)
        square = (dot(f0, f0) + dot(f1, f1) + dot(f2, f2)) / 3.0
        inverse = 1.0 / np.sqrt(square)
        # F is scaled first, since products in the determinant could overflow; if the mean square
        # of the singular values of F overflows or vanishes, the SVD is used
        x0, x1, x2 = scaled(inverse, f0), scaled(inverse, f1), scaled(inverse, f2)
        suited = square > lanes.SMALLEST and dot(x0, cross(x1, x2)) > WELL_CONDITIONED
        lanes.save_matrix(work, P, lane, (x0, x1, x2))
        work[FOUND * LANES + lane] = _OPEN if suited else _UNSUITED


@lanes.lane_function
def _advance(work):
    """Do a step of X <- (X + X^-T) / 2 for the elements in ``work`` that still need one."""
    for lane in range(LANES):
        x0, x1, x2 = lanes.load_matrix(work, P, lane)
        c0, c1, c2 = cross(x1, x2), cross(x2, x0), cross(x0, x1)
        inverse = 0.5 / dot(x0, c0)
        n0, n1, n2 = mix(0.5, x0, inverse, c0), mix(0.5, x1, inverse, c1), mix(0.5, x2, inverse, c2)
        step = square_distance(n0, x0) + square_distance(n1, x1) + square_distance(n2, x2)
        mark = work[FOUND * LANES + lane]
        is_open = mark == _OPEN
        new = choose(is_open, n0, x0), choose(is_open, n1, x1), choose(is_open, n2, x2)
        lanes.save_matrix(work, P, lane, new)
        work[FOUND * LANES + lane] = _FOUND if is_open and step < LAST_STEP else mark


@lanes.lane_function
def _rotations(work):
    """Save at offset P the rotation nearest to F, at FOUND 1 if the iteration converged, else 0."""
    _start(work)
    for _ in range(STEPS):
        _advance(work)
        if lanes.unmarked(work, FOUND) == 0.0:
            break
    for lane in range(LANES):
        mark = work[FOUND * LANES + lane]
        work[FOUND * LANES + lane] = 1.0 if mark == _FOUND else 0.0


@lanes.lane_function
def _within_range(work, low, high):
    """Copy F to P; set FOUND to 1 if the singular values of F are surely in [low, high], else to 0.

    They are if det F > 0 and |F^T F - I|_F, a bound on the distance of every squared singular value
    from 1, is smaller than the distances of low^2 and high^2 from 1.
    """
    slack = min(1.0 - low * low, high * high - 1.0)
    for lane in range(LANES):
        f0, f1, f2 = lanes.load_matrix(work, F, lane)
        g0, g1, g2 = dot(f0, f0) - 1.0, dot(f1, f1) - 1.0, dot(f2, f2) - 1.0
        h0, h1, h2 = dot(f1, f2), dot(f2, f0), dot(f0, f1)
        distance = g0 * g0 + g1 * g1 + g2 * g2 + 2.0 * (h0 * h0 + h1 * h1 + h2 * h2)
        inside = distance < slack * slack and dot(f0, cross(f1, f2)) > 0.0
        lanes.save_matrix(work, P, lane, (f0, f1, f2))
        work[FOUND * LANES + lane] = 1.0 if inside else 0.0


# number of packed numbers of an element: the weight and 9 entries of the operator
GEOMETRY = 10


@lanes.lane_function
def gradients(work, geometry, block):
    """Write S q = F^T of block number ``block`` to ``work``, from its edges and ``geometry``."""
    start = block * GEOMETRY + OPERATOR
    for lane in range(LANES):
        e0, e1, e2 = lanes.load_matrix(work, EDGE, lane)
        for i in range(3):
            row = lanes.load(geometry, start + 3 * i, lane)
            lanes.save(work, F + 3 * i, lane, lanes.mix3(row[0], e0, row[1], e1, row[2], e2))


@lanes.lane_function
def _nearest(work, low, high):
    """Write the projections of a block, with singular values in [low, high], to ``work``.

    The SVD is computed only if `_rotations` or `_within_range` leaves the projection of an element
    open. The projection of a matrix with an entry that is not finite is nan.
    """
    if low == high == 1.0:
        _rotations(work)
    else:
        _within_range(work, low, high)
    if lanes.unmarked(work, FOUND) > 0.0:
        svd3.factor_block(work)
        for lane in range(LANES):
            s, scale = lanes.load(work, svd3.SIGMA, lane), work[svd3.SCALE * LANES + lane]
            first = lanes.clamp(s[0], low, high) + 0.0 * scale
            sigma = first, lanes.clamp(s[1], low, high), lanes.clamp(s[2], low, high)
            lanes.save(work, svd3.SIGMA, lane, sigma)
        svd3.compose_block(work)


@lanes.lane_function
def forces(work, geometry, block):
    """Write forces S^T W p on the corners and add w |S q - p|^2 to the energies, all in ``work``.

    ``geometry`` has the packed numbers of all blocks, ``block`` is the index of this block.
    """
    weight, start = block * GEOMETRY + WEIGHT, block * GEOMETRY + OPERATOR
    for lane in range(LANES):
        f0, f1, f2 = lanes.load_matrix(work, F, lane)
        p0, p1, p2 = lanes.load_matrix(work, P, lane)
        r0, r1, r2 = lanes.load_matrix(geometry, start, lane)
        w = at(geometry, weight * LANES + lane)
        for corner in range(3):
            force = lanes.mix3(r0[corner], p0, r1[corner], p1, r2[corner], p2)
            lanes.save(work, FORCE + 3 * corner, lane, scaled(w, force))
        work[ENERGY * LANES + lane] += w * (
            square_distance(f0, p0) + square_distance(f1, p1) + square_distance(f2, p2)
        )


@local_kernel
def _project(y, p, record):
    return singular_values.project(y, p, record, 3, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record):
    return singular_values.accumulate(y, rhs, record, 3, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    singular_values.project_gradients(d, allowed, p, m, 3, svd3.SIZE, _nearest)


class TetrahedronGroup(singular_values.SingularValueGroup):
    """One constraint per tetrahedron on its deformation gradient; weight w times rest volume."""

    cells = "tetrahedron"
    rows_per_element = 3
    work_size = svd3.SIZE
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients

    def __init__(self, config: GroupConfig, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = require_cells(mesh, "tetrahedra", self.name)
        corner = mesh.points[self.stencil]
        edges = (corner[:, 1:] - corner[:, :1]).transpose(0, 2, 1)
        self.weights = self.element_weights(mesh) * np.abs(np.linalg.det(edges)) / 6.0
        self._set_up(mesh, np.linalg.inv(edges))


class TetrahedronStrain(TetrahedronGroup):
    """Projection of F to the nearest p with det p > 0, singular values in [minimum, maximum]."""

    class Config(singular_values.StrainConfig):
        """Weight w per volume, N/m^2, and the range of singular values."""

        effect: Literal["tetrahedron_strain"] = "tetrahedron_strain"


class DeformationGradient(TetrahedronGroup):
    """Projection of F to the nearest rotation U V^T with determinant +1 (singular values 1)."""

    class Config(GroupConfig):
        """Weight w per volume, N/m^2."""

        effect: Literal["deformation_gradient"] = "deformation_gradient"

    allowed = (1.0, 1.0)
