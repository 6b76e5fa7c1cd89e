"""Triangle strain: singular values of the 3 x 2 deformation gradient clamped to a range.

Bouaziz et al. 2014, sect. 5.1. F maps a rest frame in the triangle's plane (2-D) to space, so that
the constraint is invariant under rotations, also out of the plane. S q = F^T, two rows an element.
"""

from typing import Annotated, Literal, Self

import numpy as np
from numba import njit
from pydantic import Field, model_validator

from pdrom.constraints.base import GroupConfig, StencilGroup, require_cells
from pdrom.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.constraints.vectors import perpendicular
from pdrom.mesh.types import Mesh


class StrainConfig(GroupConfig):
    """Allowed singular values [``minimum``, ``maximum``]; ``minimum`` > 0."""

    minimum: Annotated[float, Field(gt=0.0, le=1.0)] = 0.99
    maximum: Annotated[float, Field(ge=1.0, le=1e3)] = 1.01

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum > self.maximum:
            raise ValueError(f"minimum = {self.minimum} exceeds maximum = {self.maximum}")
        return self


class TriangleStrain(StencilGroup):
    """One constraint per triangle, weight w A_t."""

    class Config(StrainConfig):
        """Weight w per area, N/m (times the clamped strain)."""

        effect: Literal["strain"] = "strain"

    rows_per_element = 2

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = require_cells(mesh, "triangles", self.name)
        rest_inverse, area = rest_frames(mesh.points, self.stencil)
        self.weights = config.weight * area
        # F = [q1 - q0, q2 - q0] D^-1, hence F^T = D^-T [q1 - q0; q2 - q0]
        transposed = rest_inverse.transpose(0, 2, 1)
        self.operator = np.concatenate([-transposed.sum(axis=2, keepdims=True), transposed], axis=2)
        self._assemble(mesh.vertices)

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        p = np.empty((2 * len(elements), 3))
        low, high = self.config.minimum, self.config.maximum
        _project(y, elements, self.stencil, self.operator, low, high, p)
        return p

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        low, high = self.config.minimum, self.config.maximum
        return _accumulate(y, self.stencil, self.operator, self.weights, low, high, rhs)

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return np.tile([self.config.minimum, self.config.maximum], (self.elements, 1))

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d, full_matrices=False)
        clamped = np.clip(sigma, self.config.minimum, self.config.maximum)
        return (u * clamped[:, None, :]) @ vt


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


@njit(cache=True, error_model="numpy")
def _clamp_columns(f, low, high, p):
    """Clamp the singular values of the 3 x 2 matrix with columns f[0], f[1]; columns of p.

    One-sided Jacobi: a single rotation makes two columns orthogonal, their norms are the singular
    values. Working on F, not on F^T F, keeps small singular values accurate.
    """
    alpha = f[0, 0] * f[0, 0] + f[0, 1] * f[0, 1] + f[0, 2] * f[0, 2]
    beta = f[1, 0] * f[1, 0] + f[1, 1] * f[1, 1] + f[1, 2] * f[1, 2]
    gamma = f[0, 0] * f[1, 0] + f[0, 1] * f[1, 1] + f[0, 2] * f[1, 2]
    c, s = 1.0, 0.0
    if abs(gamma) > 1e-16 * np.sqrt(alpha * beta):
        zeta = (beta - alpha) / (2.0 * gamma)
        t = 1.0 / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
        if zeta < 0.0:
            t = -t
        c = 1.0 / np.sqrt(1.0 + t * t)
        s = c * t
    a0, a1, a2 = c * f[0, 0] - s * f[1, 0], c * f[0, 1] - s * f[1, 1], c * f[0, 2] - s * f[1, 2]
    b0, b1, b2 = s * f[0, 0] + c * f[1, 0], s * f[0, 1] + c * f[1, 1], s * f[0, 2] + c * f[1, 2]
    swapped = a0 * a0 + a1 * a1 + a2 * a2 < b0 * b0 + b1 * b1 + b2 * b2
    if swapped:
        a0, a1, a2, b0, b1, b2 = b0, b1, b2, a0, a1, a2
    sigma_a = np.sqrt(a0 * a0 + a1 * a1 + a2 * a2)
    if sigma_a > 0.0:
        a0, a1, a2 = a0 / sigma_a, a1 / sigma_a, a2 / sigma_a
    else:
        a0, a1, a2 = 1.0, 0.0, 0.0
    # what rounding left of the large column in the small one would tilt its direction
    overlap = a0 * b0 + a1 * b1 + a2 * b2
    b0, b1, b2 = b0 - overlap * a0, b1 - overlap * a1, b2 - overlap * a2
    sigma_b = np.sqrt(b0 * b0 + b1 * b1 + b2 * b2)
    if sigma_b > 1e-15 * sigma_a:
        b0, b1, b2 = b0 / sigma_b, b1 / sigma_b, b2 / sigma_b
    else:
        b0, b1, b2 = perpendicular(a0, a1, a2)
    clamped_a, clamped_b = min(max(sigma_a, low), high), min(max(sigma_b, low), high)
    a0, a1, a2 = a0 * clamped_a, a1 * clamped_a, a2 * clamped_a
    b0, b1, b2 = b0 * clamped_b, b1 * clamped_b, b2 * clamped_b
    if swapped:
        a0, a1, a2, b0, b1, b2 = b0, b1, b2, a0, a1, a2
    p[0, 0], p[0, 1], p[0, 2] = c * a0 + s * b0, c * a1 + s * b1, c * a2 + s * b2
    p[1, 0], p[1, 1], p[1, 2] = c * b0 - s * a0, c * b1 - s * a1, c * b2 - s * a2


@njit(cache=True, error_model="numpy")
def _gradient(y, vertices, operator, f):
    """Rows of F^T of one triangle."""
    for row in range(2):
        for axis in range(3):
            f[row, axis] = operator[row, 1] * (
                y[vertices[1], axis] - y[vertices[0], axis]
            ) + operator[row, 2] * (y[vertices[2], axis] - y[vertices[0], axis])


@njit(cache=True, error_model="numpy")
def _project(y, elements, stencil, operator, low, high, p):
    f = np.empty((2, 3))
    for i in range(elements.shape[0]):
        e = elements[i]
        _gradient(y, stencil[e], operator[e], f)
        _clamp_columns(f, low, high, p[2 * i : 2 * i + 2])


@njit(cache=True, error_model="numpy")
def _accumulate(y, stencil, operator, weights, low, high, rhs):
    energy = 0.0
    f = np.empty((2, 3))
    p = np.empty((2, 3))
    for e in range(stencil.shape[0]):
        _gradient(y, stencil[e], operator[e], f)
        _clamp_columns(f, low, high, p)
        w = weights[e]
        for axis in range(3):
            first = w * (operator[e, 0, 1] * p[0, axis] + operator[e, 1, 1] * p[1, axis])
            second = w * (operator[e, 0, 2] * p[0, axis] + operator[e, 1, 2] * p[1, axis])
            rhs[stencil[e, 1], axis] += first
            rhs[stencil[e, 2], axis] += second
            rhs[stencil[e, 0], axis] -= first + second
            energy += w * ((f[0, axis] - p[0, axis]) ** 2 + (f[1, axis] - p[1, axis]) ** 2)
    return 0.5 * energy


@gradient_kernel
def _project_gradients(d_pointer, range_pointer, p_pointer, m):
    d, p = carray(d_pointer, (m, 2, 3)), carray(p_pointer, (m, 2, 3))
    allowed = carray(range_pointer, (m, 2))
    for i in range(m):
        _clamp_columns(d[i], allowed[i, 0], allowed[i, 1], p[i])
