"""Constraints on the volume of tetrahedra and the area of triangles (Bouaziz et al. 2014, 5.1).

Allowed deformation gradients F have det F (volume) or the product of their two singular values
(area) in a range. As an element may become arbitrarily long and thin without a change of volume or
area, the entries of allowed matrices, and thus of projections, have no bound.
"""

from typing import Literal

from pdrom.model.constraints import lanes, products, singular_values, svd3, triangle_strain
from pdrom.model.constraints.local_kernel import gradient_kernel, local_kernel
from pdrom.model.constraints.simplex import SIZE, F, P
from pdrom.model.constraints.svd3 import FOUND, SIGMA, rotated_pair
from pdrom.model.constraints.tetrahedron import TetrahedronGroup, forces, gradients

# working array of volume constraints: offset of the numbers that module `products` uses; its size
VALUES, WORK = svd3.SIZE, svd3.SIZE + products.SIZE


@lanes.lane_function
def _nearest(work, low, high):
    """Write to ``work`` each element's projection: matrix nearest to F with det in [low, high]."""
    for lane in range(lanes.LANES):
        f0, f1, f2 = lanes.load_matrix(work, F, lane)
        volume = lanes.dot(f0, lanes.cross(f1, f2))
        lanes.save_matrix(work, P, lane, (f0, f1, f2))
        work[FOUND * lanes.LANES + lane] = 1.0 if volume >= low and volume <= high else 0.0
    if lanes.unmarked(work, FOUND) == 0.0:
        return
    svd3.factor_block(work)
    values = work[VALUES * lanes.LANES :]
    for lane in range(lanes.LANES):
        lanes.save(values, products.VALUES, lane, lanes.load(work, SIGMA, lane))
    products.nearest_block(values, low, high, True)
    for lane in range(lanes.LANES):
        lanes.save(work, SIGMA, lane, lanes.load(values, products.VALUES, lane))
    svd3.compose_block(work)


@local_kernel
def _project(y, p, record):
    return singular_values.project(y, p, record, 3, gradients, _nearest)


@local_kernel
def _accumulate(y, rhs, record):
    return singular_values.accumulate(y, rhs, record, 3, gradients, _nearest, forces)


@gradient_kernel
def _project_gradients(d, allowed, p, m):
    singular_values.project_gradients(d, allowed, p, m, 3, WORK, _nearest)


class TetrahedronVolume(TetrahedronGroup):
    """One constraint per tetrahedron on det F = volume / rest volume V_t, with the weight w V_t.

    The projection of an inverted tetrahedron has a positive volume.
    """

    class Config(singular_values.StrainConfig):
        """Weight w per volume, N/m^2; allowed range [minimum, maximum] of volume / rest volume."""

        effect: Literal["volume"] = "volume"

    work_size = WORK
    project_kernel = _project
    accumulate_kernel = _accumulate
    gradient_kernel = _project_gradients
    manifold = "size"


# further offsets in the working array of area constraints: columns of U, cosine and sine of the
# rotation V, followed by the `products.SIZE` values with which module `products` works
U, COSINE, SINE = SIZE, SIZE + 6, SIZE + 7
AREA_VALUES, AREA_WORK = SIZE + 8, SIZE + 8 + products.SIZE


@lanes.lane_function
def _nearest_area(work, low, high):
    """Write to ``work``, as P, each triangle's F projected to sigma_1 sigma_2 in [low, high]."""
    values = work[AREA_VALUES * lanes.LANES :]
    for lane in range(lanes.LANES):
        f0, f1 = lanes.load(work, F, lane), lanes.load(work, F + 3, lane)
        scale, c, s, swapped, pair = rotated_pair(f0, f1, -1.0)
        u0, u1, s0, s1 = pair
        lanes.save(work, U, lane, u0)
        lanes.save(work, U + 3, lane, u1)
        # if `rotated_pair` swapped the columns, V includes the 90 degree rotation that does so
        work[COSINE * lanes.LANES + lane] = s if swapped else c
        work[SINE * lanes.LANES + lane] = -c if swapped else s
        lanes.save(values, products.VALUES, lane, (scale * s0, 1.0, scale * s1))
    products.nearest_block(values, low, high, False)
    for lane in range(lanes.LANES):
        sigma = lanes.load(values, products.VALUES, lane)
        a = lanes.scaled(sigma[0], lanes.load(work, U, lane))
        b = lanes.scaled(sigma[2], lanes.load(work, U + 3, lane))
        c, s = work[COSINE * lanes.LANES + lane], work[SINE * lanes.LANES + lane]
        lanes.save(work, P, lane, lanes.mix(c, a, s, b))
        lanes.save(work, P + 3, lane, lanes.mix(c, b, -s, a))


@local_kernel
def _project_area(y, p, record):
    return singular_values.project(y, p, record, 2, triangle_strain.gradients, _nearest_area)


@local_kernel
def _accumulate_area(y, rhs, record):
    gradients, forces = triangle_strain.gradients, triangle_strain.forces
    return singular_values.accumulate(y, rhs, record, 2, gradients, _nearest_area, forces)


@gradient_kernel
def _project_area_gradients(d, allowed, p, m):
    singular_values.project_gradients(d, allowed, p, m, 2, AREA_WORK, _nearest_area)


class TriangleArea(triangle_strain.TriangleStrain):
    """One constraint per triangle on area / rest area A_t, with the weight w A_t."""

    class Config(singular_values.StrainConfig):
        """Weight w per area, N/m; allowed range [minimum, maximum] of area / rest area."""

        effect: Literal["area"] = "area"

    work_size = AREA_WORK
    project_kernel = _project_area
    accumulate_kernel = _accumulate_area
    gradient_kernel = _project_area_gradients
    manifold = "size"
