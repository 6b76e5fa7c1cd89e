"""What the two tetrahedron groups share: the operator S q = F^T and the fused kernels."""

import numpy as np

from pdrom.model.compiled.rows import doubles
from pdrom.model.constraints import svd3
from pdrom.model.constraints.base import require_cells
from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    lane_function,
    load,
    mix3,
    save,
    scaled,
    square_distance,
    take,
)
from pdrom.model.constraints.local_kernel import local_kernel
from pdrom.model.constraints.polar3 import rotation_block, within_range_block
from pdrom.model.constraints.simplex import (
    EDGE,
    ENERGY,
    FORCE,
    OPERATOR,
    SIZE,
    WEIGHT,
    F,
    P,
    SimplexGroup,
    arguments,
    copy_rows,
    energy,
    gather_edges,
    samples,
    scatter,
    start_energy,
    store_projections,
)
from pdrom.model.mesh.types import Mesh

# numbers of a lane in the packed geometry
GEOMETRY = 10
# where the working array of svd3 and the marks of finished lanes begin
SVD, FOUND = SIZE, SIZE + svd3.SIZE


@lane_function
def gradients(work, geometry, block):
    """S q = F^T of a block from its edges."""
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
    """Weighted forces S^T W p on the corners, and w |S q - p|^2."""
    weight, start = block * GEOMETRY + WEIGHT, block * GEOMETRY + OPERATOR
    for lane in range(LANES):
        p0, p1, p2 = load(work, P, lane), load(work, P + 3, lane), load(work, P + 6, lane)
        r0, r1, r2 = (
            load(geometry, start, lane), load(geometry, start + 3, lane),
            load(geometry, start + 6, lane),
        )  # fmt: skip
        w = geometry[weight * LANES + lane]
        for corner in range(3):
            force = mix3(r0[corner], p0, r1[corner], p1, r2[corner], p2)
            save(work, FORCE + 3 * corner, lane, scaled(w, force))
        work[ENERGY * LANES + lane] += w * (
            square_distance(load(work, F, lane), p0)
            + square_distance(load(work, F + 3, lane), p1)
            + square_distance(load(work, F + 6, lane), p2)
        )


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
    work = np.zeros((FOUND + 1) * LANES)
    for start in range(0, m, LANES):
        copy_rows(d, 3, start, work, F)
        _nearest(work, allowed[0], allowed[1])
        store_projections(work, 3, start, p)


class TetrahedronGroup(SimplexGroup):
    """One constraint per tetrahedron on the signed singular values of F, weight w V_t."""

    cells = "tetrahedron"
    rows_per_element = 3
    work_size = FOUND + 1
    split_from = 1024
    project_kernel = _project
    accumulate_kernel = _accumulate
    manifold = "clamped"
    minimum: float
    maximum: float

    def _set_up(self, mesh: Mesh) -> None:
        self.stencil = require_cells(mesh, "tetrahedra", self.name)
        corner = mesh.points[self.stencil]
        edges = (corner[:, 1:] - corner[:, :1]).transpose(0, 2, 1)
        self.weights = self.element_weights(mesh) * np.abs(np.linalg.det(edges)) / 6.0
        # F = [q1 - q0, q2 - q0, q3 - q0] D^-1, hence F^T = D^-T [q1 - q0; q2 - q0; q3 - q0]
        transposed = np.linalg.inv(edges).transpose(0, 2, 1)
        self.operator = np.concatenate([-transposed.sum(axis=2, keepdims=True), transposed], axis=2)
        self._assemble(mesh.vertices)

    def _constants(self) -> tuple[float, ...]:
        return (self.minimum, self.maximum)

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return np.array([self.minimum, self.maximum])

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d)
        # the smallest singular value carries the sign of the determinant
        flip = np.where(np.linalg.det(u) * np.linalg.det(vt) < 0.0, -1.0, 1.0)
        signed = sigma * np.stack([np.ones_like(flip), np.ones_like(flip), flip], axis=1)
        u = u * np.stack([np.ones_like(flip), np.ones_like(flip), flip], axis=1)[:, None, :]
        return (u * np.clip(signed, self.minimum, self.maximum)[:, None, :]) @ vt
