"""L-BFGS with the system matrix of projective dynamics (Liu, Bouaziz and Kavan 2017, section 4).

It minimises the objective of the frame, 1/2 |(M/h^2)^1/2 (y - s)|^2 + W(y). The inverse Hessian
begins with A^-1, A = M/h^2 + S^T W S, and is corrected by the last steps; without any it is the
local/global iteration itself. Steps are shortened until the objective falls enough.
"""

import numpy as np

from pdrom.model.compiled.dots import add_multiple, dot
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.dynamics.frames import inertia_energy, weighted
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    add_projections,
    begin,
    end,
    multiply,
    rows_of,
)

MEMORY = 5  # steps remembered, as in the paper
SUFFICIENT = 1e-4  # Armijo's constant
NOISE = 2e-15  # relative error of the objective
HALVINGS = 10  # of a step, before the plain iteration is taken, which cannot rise


class QuasiNewton(Alternative):
    """L-BFGS for all groups; an iteration has one solve and mostly one evaluation."""

    name = "l-bfgs"

    def _prepare(self, scene: Scene) -> None:
        self._matrix = rows_of(self.space.system.matrix)

    def _advance(self, part: Substeps) -> None:
        factor = self._factor(part._replace(targets=np.zeros_like(part.targets)))
        inertia = self.space.system.inertia
        _advance(*part, inertia, self.potential.tables, self._matrix, factor)


@compiled(nogil=True)
def _evaluate(y, s, base, inertia, fixed, tables, matrix, rhs, gradient):
    """The objective; ``gradient`` receives its gradient, zero at held vertices."""
    rhs[:] = base
    energy = add_projections(tables, y, rhs)
    multiply(matrix, y, gradient)
    for k in range(len(y)):
        gradient[k] -= rhs[k]
    for vertex in fixed:
        gradient[WIDTH * vertex : WIDTH * (vertex + 1)] = 0.0
    return energy + inertia_energy(y, s, inertia)


@compiled(nogil=True)
def _direction(gradient, steps, changes, curvatures, count, factor, work, direction):
    """The two-loop recursion (Nocedal 1980) with A^-1 in the middle; minus the result."""
    panels, vertices, loads, own = factor
    kept = min(count, MEMORY)
    weights = np.empty(MEMORY)
    work[:] = gradient
    for back in range(kept):
        j = (count - 1 - back) % MEMORY
        weights[j] = dot(steps[j], work) / curvatures[j]
        add_multiple(work, -weights[j], changes[j])
    direction[:] = 0.0
    sweep(panels, vertices, loads, own, work, direction)
    for back in range(kept - 1, -1, -1):
        j = (count - 1 - back) % MEMORY
        add_multiple(direction, weights[j] - dot(changes[j], direction) / curvatures[j], steps[j])
    for k in range(len(direction)):
        direction[k] = -direction[k]


@compiled(nogil=True)
def _minimise(y, s, base, inertia, fixed, tables, matrix, factor, iterations, storage):
    rhs, gradient, other, direction, trial = storage[:5]
    steps, changes = storage[5 : 5 + MEMORY], storage[5 + MEMORY :]
    curvatures, count = np.empty(MEMORY), 0
    value = _evaluate(y, s, base, inertia, fixed, tables, matrix, rhs, gradient)
    for k in range(iterations):
        _direction(gradient, steps, changes, curvatures, count, factor, rhs, direction)
        slope = dot(gradient, direction)
        if slope >= 0.0 and count:
            count = 0
            _direction(gradient, steps, changes, curvatures, count, factor, rhs, direction)
            slope = dot(gradient, direction)
        if k == iterations - 1 and count == 0:
            # the plain iteration: it needs no test
            add_multiple(y, 1.0, direction)
            return
        length, found = 1.0, np.inf
        for _ in range(HALVINGS):
            trial[:] = y
            add_multiple(trial, length, direction)
            found = _evaluate(trial, s, base, inertia, fixed, tables, matrix, rhs, other)
            if found <= value + SUFFICIENT * length * slope + NOISE * abs(value):
                break
            length *= 0.5
        else:
            if count == 0:
                return  # round-off: nothing is lower
            count = 0
            continue
        j = count % MEMORY
        for i in range(len(y)):
            steps[j, i] = trial[i] - y[i]
            changes[j, i] = other[i] - gradient[i]
        curvature = dot(steps[j], changes[j])
        if curvature > 0.0:
            curvatures[j] = curvature
            count += 1
        y[:] = trial
        gradient[:] = other
        value = found


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, tables, matrix, factor
):
    storage = np.empty((5 + 2 * MEMORY, len(y)))
    before, s = np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        _minimise(y, s, base, inertia, fixed, tables, matrix, factor, iterations, storage)
        end(y, before, step, v)
