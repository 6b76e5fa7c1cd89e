"""Edge springs: S q = q_b - q_a, projected on the rest length (Bouaziz et al. 2014, sect. 5.1)."""

from typing import Literal

import numpy as np

from pdrom.model.constraints.base import GroupConfig, directions
from pdrom.model.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    SMALLEST,
    absolute_sum,
    choose,
    dot,
    kernel,
    lane_function,
    load,
    save,
    scaled,
    square_distance,
    take,
)
from pdrom.model.constraints.simplex import (
    EDGE,
    ENERGY,
    FORCE,
    OWN,
    WEIGHT,
    P,
    SimplexGroup,
    copy_rows,
    energy,
    gather_edges,
    scatter,
    start_energy,
    store_projections,
)
from pdrom.model.mesh.types import Mesh

# numbers of a lane in the packed geometry: weight, rest edge, rest length
REST, LENGTH, GEOMETRY = 1, 4, 5


@lane_function
def _rest_lengths(work, geometry, block):
    """Edges of a block with their rest length."""
    first = block * GEOMETRY
    for lane in range(LANES):
        d, rest = load(work, EDGE, lane), load(geometry, first + REST, lane)
        length = geometry[(first + LENGTH) * LANES + lane]
        # scaled: neither overflow nor underflow of the squares
        scale = absolute_sum(d)
        unit = scaled(1.0 / (scale + SMALLEST), d)
        unit = scaled(length / np.sqrt(dot(unit, unit)), unit)
        save(work, P, lane, choose(scale == 0.0, rest, unit))


@lane_function
def _forces(work, geometry, block):
    """Weighted forces S^T W p on the end, and w |S q - p|^2."""
    weight = (block * GEOMETRY + WEIGHT) * LANES
    for lane in range(LANES):
        p, w = load(work, P, lane), geometry[weight + lane]
        save(work, FORCE, lane, scaled(w, p))
        work[ENERGY * LANES + lane] += w * square_distance(load(work, EDGE, lane), p)


@kernel
def _project(y, corners, geometry, elements, taken, taken_geometry, work, p):
    for start in range(0, elements.shape[0], LANES):
        take(corners, 2, elements, start, taken)
        take(geometry, GEOMETRY, elements, start, taken_geometry)
        gather_edges(y, taken, 0, 1, work)
        _rest_lengths(work, taken_geometry, 0)
        store_projections(work, 1, start, p)


@kernel
def _accumulate(y, corners, geometry, first, last, elements, work, rhs):
    start_energy(work)
    for block in range(first, last):
        gather_edges(y, corners, block, 1, work)
        _rest_lengths(work, geometry, block)
        _forces(work, geometry, block)
        scatter(work, corners, block, 1, elements, rhs)
    return energy(work)


@gradient_kernel
def _project_gradients(d_pointer, geometry_pointer, p_pointer, m):
    d, p = carray(d_pointer, (m, 3)), carray(p_pointer, (m, 3))
    geometry = carray(geometry_pointer, ((m + LANES - 1) // LANES * GEOMETRY * LANES,))
    work = np.zeros(OWN * LANES)
    for start in range(0, m, LANES):
        copy_rows(d, 1, start, work, EDGE)
        _rest_lengths(work, geometry, start // LANES)
        store_projections(work, 1, start, p)


class EdgeSpring(SimplexGroup):
    """One constraint per edge of the mesh (of a volume: every edge of its tetrahedra).

    p keeps the direction of the edge and takes its rest length. An edge of length zero has no
    direction: it takes the rest edge itself.
    """

    class Config(GroupConfig):
        """Weight w per edge, N/m."""

        effect: Literal["spring"] = "spring"

    cells = "edge"
    unit = "m"
    rows_per_element = 1
    per_element = ("rest",)
    split_from = 8192
    project_kernel = staticmethod(_project)
    accumulate_kernel = staticmethod(_accumulate)
    manifold = "length"

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = mesh.edges()
        self.rest = mesh.points[self.stencil[:, 1]] - mesh.points[self.stencil[:, 0]]
        self.weights = np.full(len(self.stencil), self.element_weights(mesh))
        self.operator = np.tile(np.array([[[-1.0, 1.0]]]), (len(self.stencil), 1, 1))
        self._assemble(mesh.vertices)

    def _extra(self) -> list[np.ndarray]:
        return [self.rest, np.linalg.norm(self.rest, axis=1)]

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return self._geometry

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        rest = self.rest[elements, None, :]
        direction, length = directions(d)
        rest_length = np.linalg.norm(rest, axis=2, keepdims=True)
        return np.where(length > 0.0, direction * rest_length, rest)
