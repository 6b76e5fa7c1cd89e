"""Triangle strain: singular values of the 3 x 2 deformation gradient clamped to a range.

Bouaziz et al. 2014, sect. 5.1. F maps the 2-D rest frame in the plane of the triangle to space, so
that the constraint is invariant under rotations in space. S q = F^T has two rows per element.

The singular values sigma_i of F are square roots of the eigenvalues m +- h of F^T F. The nearest
matrix is F (g_1 v_1 v_1^T + g_2 v_2 v_2^T) with g_i = clamp(sigma_i) / sigma_i and eigenvectors
v_i, which are not computed, since v_1 v_1^T - v_2 v_2^T is the traceless part of F^T F over h. The
smaller singular value comes from the cross product of the columns, without cancellation. If F is
nearly rank deficient ("flat"), a one-sided Jacobi rotation is used instead (module `svd3`). Vector
k of a stored matrix is column k of F (S q = F^T). See module `lanes` for the layout.
"""

from typing import Literal

import numpy as np

from pdrom.model.compiled.rows import at
from pdrom.model.constraints import lanes, singular_values
from pdrom.model.constraints.base import require_cells
from pdrom.model.constraints.lanes import LANES, choose, clamp, dot, load, mix, save, scaled
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.constraints.simplex import EDGE, ENERGY, FORCE, OPERATOR, SIZE, WEIGHT, F, P
from pdrom.model.constraints.svd3 import rotated_pair
from pdrom.model.mesh.types import Mesh

# F is nearly rank deficient if sigma_1 sigma_2 / ((sigma_1^2 + sigma_2^2) / 2) is below this
FLAT = 1e-2
# if (sigma_1^2 + sigma_2^2) / 2 is between these, `_closed_form` does not overflow or lose digits
LOW, HIGH = 1e-60, 1e60
# EQUAL * m is added to h, a divisor that is zero if the eigenvalues m +- h of F^T F are equal
EQUAL = 1e-17


@lanes.lane_function
def _closed_form(f0, f1, low, high):
    """Return [f0, f1] with singular values clamped to [low, high], and whether it is accurate."""
    a, b, off = dot(f0, f0), dot(f1, f1), dot(f0, f1)
    mean, half = 0.5 * (a + b), 0.5 * (a - b)
    h = np.sqrt(half * half + off * off) + EQUAL * mean
    normal = lanes.cross(f0, f1)
    product = np.sqrt(dot(normal, normal))
    large = np.sqrt(mean + h)
    # one division serves for three reciprocals
    inverse = 1.0 / (large * product * h)
    of_large, of_product, of_h = (
        inverse * product * h,
        inverse * large * h,
        inverse * large * product,
    )
    first = clamp(large, low, high) * of_large
    second = clamp(product * of_large, low, high) * (large * of_product)
    middle, slope = 0.5 * (first + second), 0.5 * (first - second) * of_h
    suited = mean > LOW and mean < HIGH and product > FLAT * mean
    p0 = mix(middle + slope * half, f0, slope * off, f1)
    p1 = mix(slope * off, f0, middle - slope * half, f1)
    return p0, p1, suited


@lanes.lane_function
def _rotated(f0, f1, low, high):
    """Return [f0, f1] with singular values clamped to [low, high], by a Jacobi rotation."""
    scale, c, s, swapped, pair = rotated_pair(f0, f1, 1.0)
    u0, u1, s0, s1 = pair
    # the term 0 * scale makes the result nan where F is not finite
    u0 = scaled(clamp(scale * s0, low, high) + 0.0 * scale, u0)
    u1 = scaled(clamp(scale * s1, low, high), u1)
    a, b = choose(swapped, u1, u0), choose(swapped, u0, u1)
    return mix(c, a, s, b), mix(c, b, -s, a)


# number of packed numbers of an element: its weight and the 2 x 2 matrix that maps edges to F^T
GEOMETRY = 5
# offset of the flag "closed form is accurate" in the working array; size of this array
FOUND, WORK = SIZE, SIZE + 1


@lanes.lane_function
def gradients(work, geometry, block):
    """Write S q = F^T of block number ``block`` to ``work``, from its edges and ``geometry``."""
    first = (block * GEOMETRY + OPERATOR) * LANES
    for lane in range(LANES):
        e0, e1 = load(work, EDGE, lane), load(work, EDGE + 3, lane)
        place = first + lane
        save(work, F, lane, mix(at(geometry, place), e0, at(geometry, place + LANES), e1))
        place += 2 * LANES
        save(work, F + 3, lane, mix(at(geometry, place), e0, at(geometry, place + LANES), e1))


@lanes.lane_function
def forces(work, geometry, block):
    """Write forces S^T W p on the corners and add w |S q - p|^2 to the energies, all in ``work``.

    ``geometry`` has the packed numbers of all blocks, ``block`` is the index of this block.
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
            lanes.square_distance(load(work, F, lane), p0)
            + lanes.square_distance(load(work, F + 3, lane), p1)
        )


@lanes.lane_function
def _nearest(work, low, high):
    """Write P: each triangle's F, singular values clamped to [low, high]; nan if not finite."""
    for lane in range(LANES):
        p0, p1, suited = _closed_form(load(work, F, lane), load(work, F + 3, lane), low, high)
        save(work, P, lane, p0)
        save(work, P + 3, lane, p1)
        work[FOUND * LANES + lane] = 1.0 if suited else 0.0
    if lanes.unmarked(work, FOUND) > 0.0:
        for lane in range(LANES):
            found = work[FOUND * LANES + lane] != 0.0
            p0, p1 = _rotated(load(work, F, lane), load(work, F + 3, lane), low, high)
            save(work, P, lane, choose(found, load(work, P, lane), p0))
            save(work, P + 3, lane, choose(found, load(work, P + 3, lane), p1))


@local_kernel
def _project(y, p, record):
    return singular_values.project(y, p, record, 2, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record):
    return singular_values.accumulate(y, rhs, record, 2, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    singular_values.project_gradients(d, allowed, p, m, 2, WORK, _nearest)


def rest_frames(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return inverse rest edge matrices D^-1 (T, 2, 2), in 2-D frames, and rest areas (T,) m^2.

    points : (N, 3) m, rest shape
    triangles : (T, 3) vertex indices
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


class TriangleStrain(singular_values.SingularValueGroup):
    """One constraint per triangle on the singular values of F; weight w A_t with rest area A_t."""

    class Config(singular_values.StrainConfig):
        """Weight w per area, N/m, and the range of singular values."""

        effect: Literal["strain"] = "strain"

    cells = "triangle"
    rows_per_element = 2
    work_size = WORK
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = require_cells(mesh, "triangles", self.name)
        rest_inverse, area = rest_frames(mesh.points, self.stencil)
        self.weights = self.element_weights(mesh) * area
        self._set_up(mesh, rest_inverse)
