"""Groups on triangles and tetrahedra that project the deformation gradient F.

S q = F^T of an element is projected onto the matrices whose singular values, or their product, lie
in a range. Groups differ in three compiled functions of a block of elements:

gradients(work, geometry, block) : compute S q from the edges
nearest(work, low, high) : compute the projections p
forces(work, geometry, block) : compute the forces S^T W p on the corners, and w |S q - p|^2

The loops over blocks are in this module. Each group has kernels that call the loops with the
group's functions, as Numba caches neither closures nor functions that take functions on disk.
"""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from pdrom.model.compiled.functions import inner
from pdrom.model.compiled.rows import doubles
from pdrom.model.constraints import products, simplex
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.constraints.lanes import LANES, take
from pdrom.model.mesh.types import Mesh


@inner(forceinline=True)
def project(y_place, p_place, record, rows, gradients, nearest):
    """Write projections of the elements that ``record`` lists; each S_e has ``rows`` rows.

    y_place, p_place, record : addresses of positions, projections and record of a local kernel
    gradients, nearest : functions of a block, which compute S q and the projections
    """
    corners, numbers = rows + 1, 1 + rows * rows
    y, _, packed, geometry, allowed, work, _ = simplex.arguments(
        y_place, p_place, record, corners, numbers
    )
    elements, taken, taken_geometry = simplex.samples(record, corners, numbers)
    p = doubles(p_place, 3 * rows * len(elements))
    low, high = allowed[0], allowed[1]
    for start in range(0, len(elements), LANES):
        take(packed, corners, elements, start, taken)
        take(geometry, numbers, elements, start, taken_geometry)
        simplex.gather_edges(y, taken, 0, rows, work)
        gradients(work, taken_geometry, 0)
        nearest(work, low, high)
        simplex.store_projections(work, rows, start, p)
    return 0.0


@inner(forceinline=True)
def accumulate(y_place, rhs_place, record, rows, gradients, nearest, forces):
    """Add S^T W p of all elements to the right-hand side; return their energy in J.

    y_place, rhs_place, record : arguments of a kernel, see `local_kernel`
    rows : number of rows of S_e
    gradients, nearest, forces : functions of a block of elements; they compute S q, p, the forces
    """
    y, rhs, corners, geometry, allowed, work, count = simplex.arguments(
        y_place, rhs_place, record, rows + 1, 1 + rows * rows
    )
    low, high = allowed[0], allowed[1]
    for lane in range(LANES):
        work[simplex.ENERGY * LANES + lane] = 0.0
    for block in range(count):
        simplex.gather_edges(y, corners, block, rows, work)
        gradients(work, geometry, block)
        nearest(work, low, high)
        forces(work, geometry, block)
        simplex.scatter(work, corners, block, rows, rhs)
    energy = 0.0
    for lane in range(LANES):
        energy += work[simplex.ENERGY * LANES + lane]
    return 0.5 * energy


@inner(forceinline=True)
def project_gradients(d_place, range_place, p_place, m, rows, work_size, nearest):
    """Write projections of m elements; the working array has ``work_size`` numbers an element.

    d_place, p_place : addresses of deformation gradients S q, and of projections: (rows m, 3)
    range_place : address of the least and the largest allowed singular value, or product of them
    nearest : function that computes the projections of a block of elements in the working array
    """
    d, p = doubles(d_place, 3 * rows * m), doubles(p_place, 3 * rows * m)
    allowed = doubles(range_place, 2)
    work = np.zeros(work_size * LANES)
    for start in range(0, m, LANES):
        simplex.copy_rows(d, rows, start, work, simplex.F)
        nearest(work, allowed[0], allowed[1])
        simplex.store_projections(work, rows, start, p)


class StrainConfig(GroupConfig):
    """Range [``minimum``, ``maximum``] of singular values, or of area or volume / value at rest."""

    minimum: Annotated[float, Field(gt=0.0, le=1.0)] = 0.99
    maximum: Annotated[float, Field(ge=1.0, le=1e3)] = 1.01

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum > self.maximum:
            raise ValueError(f"minimum = {self.minimum} exceeds maximum = {self.maximum}")
        return self


class SingularValueGroup(simplex.SimplexGroup):
    """Group on triangles or tetrahedra that projects F by changing only its singular values."""

    manifold = "clamped"

    @property
    def allowed(self) -> tuple[float, float]:
        """Least and largest allowed singular value, or allowed product of the singular values."""
        return self.config.minimum, self.config.maximum

    def _set_up(self, mesh: Mesh, inverse: np.ndarray) -> None:
        """Set the matrices S_e, which yield F^T, from inverse rest edge matrices D^-1 (e, p, p)."""
        # F = [q_1 - q_0, ..., q_p - q_0] D^-1, hence F^T = D^-T [q_1 - q_0; ...; q_p - q_0]
        transposed = inverse.transpose(0, 2, 1)
        self.operator = np.concatenate([-transposed.sum(axis=2, keepdims=True), transposed], axis=2)
        self._assemble(mesh.vertices)

    def kernel_parameters(self) -> np.ndarray:
        return np.array(self.allowed)

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d, full_matrices=False)
        if self.rows_per_element == 3:
            # the smallest singular value gets the sign of det F
            turned = np.sign(np.linalg.det(u) * np.linalg.det(vt))
            sigma[:, 2] *= turned
            u[:, :, 2] *= turned[:, None]
        nearest = np.clip if self.manifold == "clamped" else products.reference_nearest
        return (u * nearest(sigma, *self.allowed)[:, None, :]) @ vt
