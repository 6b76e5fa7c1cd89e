"""Triangle strain: singular values of the 3 x 2 deformation gradient clamped to a range.

Bouaziz et al. 2014, sect. 5.1. F maps a rest frame in the triangle's plane (2-D) to space, so that
the constraint is invariant under rotations, also out of the plane. S q = F^T, two rows an element.
"""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.model.compiled.rows import doubles
from pdrom.model.constraints.base import GroupConfig, require_cells
from pdrom.model.constraints.clamp2 import clamp_block
from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    lane_function,
    load,
    mix,
    save,
    scaled,
    square_distance,
    take,
)
from pdrom.model.constraints.local_kernel import local_kernel
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
GEOMETRY = 5
# where the marks of `clamp_block` begin in the working array
FOUND = SIZE


class StrainConfig(GroupConfig):
    """Allowed singular values [``minimum``, ``maximum``]; ``minimum`` > 0."""

    minimum: Annotated[float, Field(gt=0.0, le=1.0)] = 0.99
    maximum: Annotated[float, Field(ge=1.0, le=1e3)] = 1.01

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum > self.maximum:
            raise ValueError(f"minimum = {self.minimum} exceeds maximum = {self.maximum}")
        return self


@lane_function
def gradients(work, geometry, block):
    """S q = F^T of a block from its edges."""
    first = (block * GEOMETRY + OPERATOR) * LANES
    for lane in range(LANES):
        e0, e1 = load(work, EDGE, lane), load(work, EDGE + 3, lane)
        at = first + lane
        save(work, F, lane, mix(geometry[at], e0, geometry[at + LANES], e1))
        at += 2 * LANES
        save(work, F + 3, lane, mix(geometry[at], e0, geometry[at + LANES], e1))


@lane_function
def forces(work, geometry, block):
    """Weighted forces S^T W p on the corners, and w |S q - p|^2."""
    weight = (block * GEOMETRY + WEIGHT) * LANES
    first = (block * GEOMETRY + OPERATOR) * LANES
    for lane in range(LANES):
        p0, p1 = load(work, P, lane), load(work, P + 3, lane)
        w, at = geometry[weight + lane], first + lane
        r00, r01 = geometry[at], geometry[at + LANES]
        r10, r11 = geometry[at + 2 * LANES], geometry[at + 3 * LANES]
        save(work, FORCE, lane, scaled(w, mix(r00, p0, r10, p1)))
        save(work, FORCE + 3, lane, scaled(w, mix(r01, p0, r11, p1)))
        work[ENERGY * LANES + lane] += w * (
            square_distance(load(work, F, lane), p0) + square_distance(load(work, F + 3, lane), p1)
        )


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
        clamp_block(work, F, P, FOUND, low, high)
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
        clamp_block(work, F, P, FOUND, low, high)
        forces(work, geometry, block)
        scatter(work, corners, block, 2, rhs)
    return energy(work)


def rest_frames(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse rest edge matrices D^-1 (T, 2, 2) in a frame of each triangle, and areas (T,) m^2."""
    first = points[triangles[:, 1]] - points[triangles[:, 0]]
    second = points[triangles[:, 2]] - points[triangles[:, 0]]
    length = np.linalg.norm(first, axis=1)
    along = np.einsum("ij,ij->i", first, second) / length
    area = 0.5 * np.linalg.norm(np.cross(first, second), axis=1)
    height = 2.0 * area / length
    inverse = np.zeros((len(triangles), 2, 2))
    inverse[:, 0, 0] = 1.0 / length
    inverse[:, 0, 1] = -along / (length * height)
    inverse[:, 1, 1] = 1.0 / height
    return inverse, area


@gradient_kernel
def _project_gradients(d_pointer, range_pointer, p_pointer, m):
    d, p = carray(d_pointer, (2 * m, 3)), carray(p_pointer, (6 * m,))
    allowed = carray(range_pointer, (2,))
    work = np.zeros((FOUND + 1) * LANES)
    for start in range(0, m, LANES):
        copy_rows(d, 2, start, work, F)
        clamp_block(work, F, P, FOUND, allowed[0], allowed[1])
        store_projections(work, 2, start, p)


class TriangleStrain(SimplexGroup):
    """One constraint per triangle, weight w A_t."""

    class Config(StrainConfig):
        """Weight w per area, N/m (times the clamped strain)."""

        effect: Literal["strain"] = "strain"

    cells = "triangle"
    rows_per_element = 2
    work_size = FOUND + 1
    split_from = 4096
    project_kernel = _project
    accumulate_kernel = _accumulate
    manifold = "clamped"

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = require_cells(mesh, "triangles", self.name)
        rest_inverse, area = rest_frames(mesh.points, self.stencil)
        self.weights = self.element_weights(mesh) * area
        # F = [q1 - q0, q2 - q0] D^-1, hence F^T = D^-T [q1 - q0; q2 - q0]
        transposed = rest_inverse.transpose(0, 2, 1)
        self.operator = np.concatenate([-transposed.sum(axis=2, keepdims=True), transposed], axis=2)
        self._assemble(mesh.vertices)

    def _constants(self) -> tuple[float, ...]:
        return (self.config.minimum, self.config.maximum)

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return np.array([self.config.minimum, self.config.maximum])

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d, full_matrices=False)
        clamped = np.clip(sigma, self.config.minimum, self.config.maximum)
        return (u * clamped[:, None, :]) @ vt
