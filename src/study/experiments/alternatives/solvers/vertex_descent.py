"""Vertex block descent (Chen et al. 2024): a Newton step for one vertex after the other.

Every vertex in turn minimises a quadratic model of the frame's objective in its own three
coordinates, with the Hessians of its elements made positive semidefinite.
"""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.constraints.lanes import lane_function
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.elements import (
    MODES,
    Elements,
    decompose_element,
    hessian,
    residual,
    workspace,
)
from study.experiments.alternatives.solvers.substeps import Alternative, Substeps, begin, end


class VertexDescent(Alternative):
    """For springs, triangle strain and tetrahedra; an iteration visits every vertex once."""

    name = "vertex-descent"

    def _prepare(self, scene: Scene) -> None:
        self._elements = Elements.of(scene, self.name)
        self._around = self._elements.around(scene.mesh.vertices)

    def _advance(self, part: Substeps) -> None:
        free = np.setdiff1d(np.arange(len(self.masses)), part.fixed)
        inertia = self.space.system.inertia
        _advance(*part, free, inertia, self._elements.arrays, self._around, workspace())


@lane_function
def _add_edge(y, e, corner, corners, weights, low, fallback, g, h):
    """Gradient and Hessian of a spring at one of its ends."""
    a, b = WIDTH * corners[e, corner], WIDTH * corners[e, 1 - corner]
    d = (y[a] - y[b], y[a + 1] - y[b + 1], y[a + 2] - y[b + 2])
    length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    w, strain = weights[e], 0.0
    if length > 0.0:
        strain = 1.0 - low[e] / length
    else:
        sign = 2.0 * corner - 1.0
        d = (sign * fallback[e, 0], sign * fallback[e, 1], sign * fallback[e, 2])
        length = low[e]
        for k in range(3):
            g[k] -= w * d[k]
    across = max(strain, 0.0)
    for k in range(3):
        g[k] += w * strain * d[k]
        h[k, k] += w * across
        for m in range(3):
            h[k, m] += w * (1.0 - across) * (d[k] / length) * (d[m] / length)


@lane_function
def _add_element(
    y, e, p, corner, corners, operator, w, low, high, fallback, d, u, v, sigma, r, values, modes,
    g, h,
):  # fmt: skip
    """Gradient and Hessian of any element at one of its corners."""
    decompose_element(y, e, p, corners, operator, fallback, d, u, v, sigma)
    residual(u, v, sigma, p, low, high, r)
    for k in range(3):
        for row in range(p):
            g[k] += w * operator[e, row, corner] * r[row, k]
    for n in range(hessian(u, v, sigma, p, low, high, 0.0, values, modes)):
        for k in range(3):
            r[0, k] = 0.0
            for row in range(p):
                r[0, k] += operator[e, row, corner] * modes[n, row, k]
        for k in range(3):
            for m in range(3):
                h[k, m] += w * values[n] * r[0, k] * r[0, m]


@lane_function
def _solve3(h, g):
    """h^-1 g of a symmetric positive definite h (3, 3), by elimination."""
    a = h[1, 0] / h[0, 0]
    b = h[2, 0] / h[0, 0]
    h11, h21, h22 = h[1, 1] - a * h[1, 0], h[2, 1] - a * h[2, 0], h[2, 2] - b * h[2, 0]
    c = h21 / h11
    y1 = g[1] - a * g[0]
    y2 = g[2] - b * g[0] - c * y1
    x2 = y2 / (h22 - c * h21)
    x1 = (y1 - h21 * x2) / h11
    return ((g[0] - h[1, 0] * x1 - h[2, 0] * x2) / h[0, 0], x1, x2)


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, free, inertia, elements,
    around, work,
):  # fmt: skip
    starts, touching, corner = around
    rows, corners, operator, weights, low, high, fallback = elements
    d, left, right, sigma = work
    before, s = np.empty(len(y)), np.empty(len(y))
    g, h, r = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    values, modes = np.zeros(MODES), np.zeros((MODES, 3, 3))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        for _ in range(iterations):
            for i in free:
                h[:] = 0.0
                for k in range(3):
                    g[k] = inertia[i] * (y[WIDTH * i + k] - s[WIDTH * i + k])
                    h[k, k] = inertia[i]
                for place in range(starts[i], starts[i + 1]):
                    e = touching[place]
                    if rows[e] == 1:
                        _add_edge(y, e, corner[place], corners, weights, low, fallback, g, h)
                    else:
                        _add_element(
                            y, e, rows[e], corner[place], corners, operator, weights[e], low[e],
                            high[e], fallback, d, left, right, sigma, r, values, modes, g, h,
                        )  # fmt: skip
                x0, x1, x2 = _solve3(h, g)
                y[WIDTH * i] -= x0
                y[WIDTH * i + 1] -= x1
                y[WIDTH * i + 2] -= x2
        end(y, before, step, v)
