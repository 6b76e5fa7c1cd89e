"""Base of the groups on tetrahedra: the operator S q = F^T and the clamping kernels."""

import numpy as np

from pdrom.model.compiled.rows import at
from pdrom.model.constraints import svd3
from pdrom.model.constraints.base import GroupConfig, require_cells
from pdrom.model.constraints.gradient_kernel import gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    lane_function,
    load,
    mix3,
    save,
    scaled,
    square_distance,
)
from pdrom.model.constraints.local_kernel import local_kernel
from pdrom.model.constraints.polar3 import rotation_block, within_range_block
from pdrom.model.constraints.simplex import EDGE, ENERGY, FORCE, OPERATOR, SIZE, WEIGHT, F, P
from pdrom.model.constraints.singular_values import (
    SingularValueGroup,
    accumulate,
    project,
    project_gradients,
)
from pdrom.model.mesh.types import Mesh

# numbers of a lane in the packed geometry
GEOMETRY = 10
# where the working array of svd3 and the marks of finished lanes begin
SVD, FOUND = SIZE, SIZE + svd3.SIZE
WORK = FOUND + 1


@lane_function
def gradients(work, geometry, block):
    """S q = F^T of a ``block`` of the packed ``geometry`` from its edges, in ``work``."""
    start = block * GEOMETRY + OPERATOR
    for lane in range(LANES):
        e0, e1, e2 = load(work, EDGE, lane), load(work, EDGE + 3, lane), load(work, EDGE + 6, lane)
        for i in range(3):
            row = load(geometry, start + 3 * i, lane)
            save(work, F + 3 * i, lane, mix3(row[0], e0, row[1], e1, row[2], e2))


@lane_function
def _nearest(work, low, high):
    """Projections of a block: the cheap cases first, the SVD where a lane is left."""
    found = work[FOUND * LANES : (FOUND + 1) * LANES]
    if low == high == 1.0:
        rotation_block(work, F, work, P, found)
    else:
        within_range_block(work, F, work, P, low, high, found)
    left = 0.0
    for lane in range(LANES):
        left += 1.0 - found[lane]
    if left > 0.0:
        svd3.clamp_block(work, F, work, P, found, low, high, work[SVD * LANES :])


@lane_function
def forces(work, geometry, block):
    """Weighted forces S^T W p on the corners, and w |S q - p|^2, in ``work``.

    ``block`` and ``geometry`` as in `gradients`.
    """
    weight, start = block * GEOMETRY + WEIGHT, block * GEOMETRY + OPERATOR
    for lane in range(LANES):
        p0, p1, p2 = load(work, P, lane), load(work, P + 3, lane), load(work, P + 6, lane)
        r0, r1, r2 = (
            load(geometry, start, lane), load(geometry, start + 3, lane),
            load(geometry, start + 6, lane),
        )  # fmt: skip
        w = at(geometry, weight * LANES + lane)
        for corner in range(3):
            force = mix3(r0[corner], p0, r1[corner], p1, r2[corner], p2)
            save(work, FORCE + 3 * corner, lane, scaled(w, force))
        work[ENERGY * LANES + lane] += w * (
            square_distance(load(work, F, lane), p0)
            + square_distance(load(work, F + 3, lane), p1)
            + square_distance(load(work, F + 6, lane), p2)
        )


@local_kernel
def _project(y, p, record, part):
    return project(y, p, record, part, 3, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record, part):
    return accumulate(y, rhs, record, part, 3, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    project_gradients(d, allowed, p, m, 3, WORK, _nearest)


class TetrahedronGroup(SingularValueGroup):
    """One constraint per tetrahedron on the signed singular values of F, weight w V_t."""

    cells = "tetrahedron"
    rows_per_element = 3
    work_size = WORK
    split_from = 1024
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
