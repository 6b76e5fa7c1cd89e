"""What the two tetrahedron groups share: the operator S q = F^T and the fused kernels."""

import numpy as np
from numba import njit

from pdrom.constraints.base import StencilGroup, require_cells
from pdrom.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.constraints.polar3 import newton_rotation, within_range
from pdrom.constraints.svd3 import clamp_singular_values
from pdrom.mesh.types import Mesh


class TetrahedronGroup(StencilGroup):
    """One constraint per tetrahedron on the signed singular values of F, weight w V_t."""

    rows_per_element = 3
    minimum: float
    maximum: float

    def _set_up(self, mesh: Mesh) -> None:
        self.stencil = require_cells(mesh, "tetrahedra", self.name)
        corner = mesh.points[self.stencil]
        edges = (corner[:, 1:] - corner[:, :1]).transpose(0, 2, 1)
        self.weights = self.config.weight * np.abs(np.linalg.det(edges)) / 6.0
        # F = [q1 - q0, q2 - q0, q3 - q0] D^-1, hence F^T = D^-T [q1 - q0; q2 - q0; q3 - q0]
        transposed = np.linalg.inv(edges).transpose(0, 2, 1)
        self.operator = np.concatenate([-transposed.sum(axis=2, keepdims=True), transposed], axis=2)
        self._assemble(mesh.vertices)

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        p = np.empty((3 * len(elements), 3))
        _project(y, elements, self.stencil, self.operator, self.minimum, self.maximum, p)
        return p

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        return _accumulate(
            y, self.stencil, self.operator, self.weights, self.minimum, self.maximum, rhs
        )

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return np.tile([self.minimum, self.maximum], (self.elements, 1))

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        u, sigma, vt = np.linalg.svd(d)
        # the smallest singular value carries the sign of the determinant
        flip = np.where(np.linalg.det(u) * np.linalg.det(vt) < 0.0, -1.0, 1.0)
        signed = sigma * np.stack([np.ones_like(flip), np.ones_like(flip), flip], axis=1)
        u = u * np.stack([np.ones_like(flip), np.ones_like(flip), flip], axis=1)[:, None, :]
        return (u * np.clip(signed, self.minimum, self.maximum)[:, None, :]) @ vt


@njit(cache=True, error_model="numpy")
def _gradient(y, vertices, operator, f):
    """Rows of F^T of one tetrahedron."""
    for axis in range(3):
        origin = y[vertices[0], axis]
        e1 = y[vertices[1], axis] - origin
        e2 = y[vertices[2], axis] - origin
        e3 = y[vertices[3], axis] - origin
        for row in range(3):
            f[row, axis] = operator[row, 1] * e1 + operator[row, 2] * e2 + operator[row, 3] * e3


@njit(cache=True, error_model="numpy")
def _nearest(f, low, high, u, sigma, v, p):
    """Projection of one tetrahedron: the cheap cases first, the SVD for what they leave."""
    if low == high:
        if low == 1.0 and newton_rotation(f, p):
            return
    elif within_range(f, low, high):
        for i in range(3):
            for a in range(3):
                p[i, a] = f[i, a]
        return
    clamp_singular_values(f, low, high, u, sigma, v, p)


@njit(cache=True, error_model="numpy")
def _project(y, elements, stencil, operator, low, high, p):
    f, u, v, sigma = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(elements.shape[0]):
        e = elements[i]
        _gradient(y, stencil[e], operator[e], f)
        _nearest(f, low, high, u, sigma, v, p[3 * i : 3 * i + 3])


@njit(cache=True, error_model="numpy")
def _accumulate(y, stencil, operator, weights, low, high, rhs):
    energy = 0.0
    f, p, u, v = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    sigma = np.empty(3)
    for e in range(stencil.shape[0]):
        _gradient(y, stencil[e], operator[e], f)
        _nearest(f, low, high, u, sigma, v, p)
        w = weights[e]
        for axis in range(3):
            total = 0.0
            for corner in range(1, 4):
                force = w * (
                    operator[e, 0, corner] * p[0, axis]
                    + operator[e, 1, corner] * p[1, axis]
                    + operator[e, 2, corner] * p[2, axis]
                )
                rhs[stencil[e, corner], axis] += force
                total += force
            rhs[stencil[e, 0], axis] -= total
            energy += w * (
                (f[0, axis] - p[0, axis]) ** 2
                + (f[1, axis] - p[1, axis]) ** 2
                + (f[2, axis] - p[2, axis]) ** 2
            )
    return 0.5 * energy


@gradient_kernel
def _project_gradients(d_pointer, range_pointer, p_pointer, m):
    d, p = carray(d_pointer, (m, 3, 3)), carray(p_pointer, (m, 3, 3))
    allowed = carray(range_pointer, (m, 2))
    u, v, sigma = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(m):
        _nearest(d[i], allowed[i, 0], allowed[i, 1], u, sigma, v, p[i])
