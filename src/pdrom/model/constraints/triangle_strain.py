"""Triangle strain: singular values of the 3 x 2 deformation gradient clamped to a range.

Bouaziz et al. 2014, sect. 5.1. F maps a rest frame in the triangle's plane (2-D) to space, so that
the constraint is invariant under rotations, also out of the plane. S q = F^T, two rows an element.
"""

from typing import Literal

import numpy as np

from pdrom.model.compiled.rows import at
from pdrom.model.constraints.base import require_cells
from pdrom.model.constraints.clamp2 import clamp_block
from pdrom.model.constraints.gradient_kernel import gradient_kernel
from pdrom.model.constraints.lanes import (
    LANES,
    lane_function,
    load,
    mix,
    save,
    scaled,
    square_distance,
)
from pdrom.model.constraints.local_kernel import local_kernel
from pdrom.model.constraints.simplex import EDGE, ENERGY, FORCE, OPERATOR, SIZE, WEIGHT, F, P
from pdrom.model.constraints.singular_values import (
    SingularValueGroup,
    StrainConfig,
    accumulate,
    project,
    project_gradients,
)
from pdrom.model.mesh.types import Mesh

# numbers of a lane in the packed geometry
GEOMETRY = 5
# where the marks of `clamp_block` begin in the working array
FOUND, WORK = SIZE, SIZE + 1


@lane_function
def gradients(work, geometry, block):
    """S q = F^T of a ``block`` of the packed ``geometry`` from its edges, in ``work``."""
    first = (block * GEOMETRY + OPERATOR) * LANES
    for lane in range(LANES):
        e0, e1 = load(work, EDGE, lane), load(work, EDGE + 3, lane)
        place = first + lane
        save(work, F, lane, mix(at(geometry, place), e0, at(geometry, place + LANES), e1))
        place += 2 * LANES
        save(work, F + 3, lane, mix(at(geometry, place), e0, at(geometry, place + LANES), e1))


@lane_function
def forces(work, geometry, block):
    """Weighted forces S^T W p on the corners, and w |S q - p|^2, in ``work``.

    ``block`` and ``geometry`` as in `gradients`.
    """
    weight = (block * GEOMETRY + WEIGHT) * LANES
    first = (block * GEOMETRY + OPERATOR) * LANES
    for lane in range(LANES):
        p0, p1 = load(work, P, lane), load(work, P + 3, lane)
        w, place = at(geometry, weight + lane), first + lane
        r00, r01 = at(geometry, place), at(geometry, place + LANES)
        r10, r11 = at(geometry, place + 2 * LANES), at(geometry, place + 3 * LANES)
        save(work, FORCE, lane, scaled(w, mix(r00, p0, r10, p1)))
        save(work, FORCE + 3, lane, scaled(w, mix(r01, p0, r11, p1)))
        work[ENERGY * LANES + lane] += w * (
            square_distance(load(work, F, lane), p0) + square_distance(load(work, F + 3, lane), p1)
        )


@lane_function
def _nearest(work, low, high):
    """Projections of a block."""
    clamp_block(work, F, P, FOUND, low, high)


@local_kernel
def _project(y, p, record, part):
    return project(y, p, record, part, 2, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record, part):
    return accumulate(y, rhs, record, part, 2, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    project_gradients(d, allowed, p, m, 2, WORK, _nearest)


def rest_frames(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse rest edge matrices D^-1 (T, 2, 2) in a frame of each triangle, and areas (T,) m^2.

    Parameters
    ----------
    points : (N, 3) m
    triangles : (T, 3)
    """
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


class TriangleStrain(SingularValueGroup):
    """One constraint per triangle, weight w A_t."""

    class Config(StrainConfig):
        """Weight w per area, N/m (times the clamped strain)."""

        effect: Literal["strain"] = "strain"

    cells = "triangle"
    rows_per_element = 2
    work_size = WORK
    split_from = 4096
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = require_cells(mesh, "triangles", self.name)
        rest_inverse, area = rest_frames(mesh.points, self.stencil)
        self.weights = self.element_weights(mesh) * area
        self._set_up(mesh, rest_inverse)
