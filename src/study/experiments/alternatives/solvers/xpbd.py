"""XPBD: compliant constraints, one after the other (Macklin, Mueller and Chentanez 2016).

The constraint of an element is its distance to the manifold, C = |S_e q - p_e|, with the compliance
1 / w: its energy 1/2 w C^2 is that of projective dynamics, and for a spring C is the change of its
length. Iterations go through the elements
colour by colour (Gauss-Seidel). What they converge to is
near the implicit step, not the step itself: the directions of earlier corrections stay as they were
when the multiplier was added.
"""

import numpy as np

from pdrom.model.compiled.arithmetic import add_scaled, multiply, of_three, subtract, total
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at, load, store
from pdrom.model.constraints.lanes import lane_function
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.elements import (
    Elements,
    decompose_element,
    residual,
    workspace,
)
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    begin,
    end,
    inverse_masses,
)


class CompliantConstraints(Alternative):
    """XPBD for springs, triangle strain and tetrahedra; one iteration in each of many substeps is
    the method of Macklin et al. 2019."""

    name = "xpbd"

    def _prepare(self, scene: Scene) -> None:
        self._elements = Elements.of(scene, self.name).by_colour()

    def _advance(self, part: Substeps) -> None:
        inverse = inverse_masses(self.masses, part.fixed)
        _advance(*part, inverse, self._elements.arrays, workspace())


@lane_function
def _relax_edge(y, e, corners, low, fallback, compliance, inverse, share, multipliers):
    """One correction of a spring; ``share`` is 1 / (1 / m_a + 1 / m_b + compliance)."""
    a, b = WIDTH * at(corners, 4 * e), WIDTH * at(corners, 4 * e + 1)
    d = subtract(load(y, b), load(y, a))
    length, rest = np.sqrt(total(multiply(d, d))), low[e]
    if length == 0.0:
        d, length = of_three(fallback[e, 0], fallback[e, 1], fallback[e, 2]), rest
        change = rest - compliance * multipliers[e]
    else:
        change = rest - length - compliance * multipliers[e]
    change *= share
    multipliers[e] += change
    change /= length
    store(y, a, add_scaled(load(y, a), -change * inverse[a // WIDTH], d))
    store(y, b, add_scaled(load(y, b), change * inverse[b // WIDTH], d))


@lane_function
def _relax(
    y, e, p, corners, operator, low, high, fallback, compliance, inverse, multipliers, d, u, v,
    sigma, r, gradient,
):  # fmt: skip
    """One correction of any element; none where it fulfils its constraint."""
    decompose_element(y, e, p, corners, operator, fallback, d, u, v, sigma)
    square = residual(u, v, sigma, p, low[e], high[e], r)
    if square == 0.0:
        return
    distance, masses = np.sqrt(square), 0.0
    for corner in range(p + 1):
        for k in range(3):
            total = 0.0
            for row in range(p):
                total += operator[e, row, corner] * r[row, k]
            gradient[corner, k] = total / distance
            masses += inverse[corners[e, corner]] * gradient[corner, k] ** 2
    change = -(distance + compliance * multipliers[e]) / (masses + compliance)
    multipliers[e] += change
    for corner in range(p + 1):
        vertex = corners[e, corner]
        for k in range(3):
            y[WIDTH * vertex + k] += inverse[vertex] * change * gradient[corner, k]


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inverse, elements, work
):
    rows, corners, operator, weights, low, high, fallback = elements
    d, left, right, sigma = work
    before, s = np.empty(len(y)), np.empty(len(y))
    multipliers, r, gradient = np.empty(len(rows)), np.zeros((3, 3)), np.zeros((4, 3))
    compliance = 1.0 / (weights * step**2)
    shares = 1.0 / (inverse[corners[:, 0]] + inverse[corners[:, 1]] + compliance)
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        multipliers[:] = 0.0
        for _ in range(iterations):
            for e in range(len(rows)):
                soft = compliance[e]
                if rows[e] == 1:
                    _relax_edge(y, e, corners, low, fallback, soft, inverse, shares[e], multipliers)
                else:
                    _relax(
                        y, e, rows[e], corners, operator, low, high, fallback, soft, inverse,
                        multipliers, d, left, right, sigma, r, gradient,
                    )  # fmt: skip
        end(y, before, step, v)
