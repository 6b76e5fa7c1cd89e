"""Edge springs: S q = q_b - q_a, projected on the rest length (Bouaziz et al. 2014, sect. 5.1)."""

from typing import Literal

import numpy as np
from numba import njit

from pdrom.constraints.base import GroupConfig, StencilGroup
from pdrom.constraints.gradient_kernel import carray, gradient_kernel
from pdrom.mesh.types import Mesh


class EdgeSpring(StencilGroup):
    """One constraint per edge of the mesh (of a volume: every edge of its tetrahedra).

    p keeps the direction of the edge and takes its rest length. An edge of length zero has no
    direction: it takes the rest edge itself.
    """

    class Config(GroupConfig):
        """Weight w per edge, N/m."""

        effect: Literal["spring"] = "spring"

    rows_per_element = 1
    per_element = ("rest",)

    def __init__(self, config: Config, mesh: Mesh, masses: np.ndarray) -> None:
        super().__init__(config, mesh, masses)
        self.stencil = mesh.edges()
        self.rest = mesh.points[self.stencil[:, 1]] - mesh.points[self.stencil[:, 0]]
        self.weights = np.full(len(self.stencil), config.weight)
        self.operator = np.tile(np.array([[[-1.0, 1.0]]]), (len(self.stencil), 1, 1))
        self._assemble(mesh.vertices)

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        p = np.empty((len(elements), 3))
        _project(y, elements, self.stencil, self.rest, p)
        return p

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        return _accumulate(y, self.stencil, self.rest, self.weights, rhs)

    @property
    def gradient_kernel(self):
        return _project_gradients

    def kernel_parameters(self) -> np.ndarray:
        return self.rest

    def reference_project(self, d: np.ndarray, elements: np.ndarray) -> np.ndarray:
        rest = self.rest[elements, None, :]
        length = np.linalg.norm(d, axis=2, keepdims=True)
        rest_length = np.linalg.norm(rest, axis=2, keepdims=True)
        safe = np.where(length > 0.0, length, 1.0)
        return np.where(length > 0.0, d / safe * rest_length, rest)


@njit(cache=True, error_model="numpy")
def _spring(dx, dy, dz, rest):
    """Projection of one edge vector: (px, py, pz)."""
    # scaled by the largest component: neither overflow nor underflow of the squares
    largest = max(abs(dx), abs(dy), abs(dz))
    if largest == 0.0:
        return rest[0], rest[1], rest[2]
    sx, sy, sz = dx / largest, dy / largest, dz / largest
    rest_length = np.sqrt(rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2])
    factor = rest_length / np.sqrt(sx * sx + sy * sy + sz * sz)
    return sx * factor, sy * factor, sz * factor


@njit(cache=True, error_model="numpy")
def _project(y, elements, stencil, rest, p):
    for i in range(elements.shape[0]):
        e = elements[i]
        a, b = stencil[e, 0], stencil[e, 1]
        p[i, 0], p[i, 1], p[i, 2] = _spring(
            y[b, 0] - y[a, 0], y[b, 1] - y[a, 1], y[b, 2] - y[a, 2], rest[e]
        )


@njit(cache=True, error_model="numpy")
def _accumulate(y, stencil, rest, weights, rhs):
    energy = 0.0
    for e in range(stencil.shape[0]):
        a, b = stencil[e, 0], stencil[e, 1]
        dx, dy, dz = y[b, 0] - y[a, 0], y[b, 1] - y[a, 1], y[b, 2] - y[a, 2]
        px, py, pz = _spring(dx, dy, dz, rest[e])
        w = weights[e]
        rhs[b, 0] += w * px
        rhs[b, 1] += w * py
        rhs[b, 2] += w * pz
        rhs[a, 0] -= w * px
        rhs[a, 1] -= w * py
        rhs[a, 2] -= w * pz
        energy += w * ((dx - px) ** 2 + (dy - py) ** 2 + (dz - pz) ** 2)
    return 0.5 * energy


@gradient_kernel
def _project_gradients(d_pointer, rest_pointer, p_pointer, m):
    d, p = carray(d_pointer, (m, 3)), carray(p_pointer, (m, 3))
    rest = carray(rest_pointer, (m, 3))
    for i in range(m):
        p[i, 0], p[i, 1], p[i, 2] = _spring(d[i, 0], d[i, 1], d[i, 2], rest[i])
