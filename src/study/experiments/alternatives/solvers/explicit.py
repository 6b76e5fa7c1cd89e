"""Explicit integration by position Verlet: half a drift, a kick, half a drift.

Of second order and symplectic (Tuckerman et al. 1992), with one evaluation of the forces a substep.
Stable while the substep is shorter than 2 / omega of the stiffest mode.
"""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from study.experiments.alternatives.solvers.potential import add_projections, multiply
from study.experiments.alternatives.solvers.substeps import Alternative, Substeps, inverse_masses


class Explicit(Alternative):
    """Substeps without a system of equations, for all groups; ``iterations`` mean nothing."""

    name = "explicit"

    def _advance(self, part: Substeps) -> None:
        rows, fixed = part.y.reshape(-1, WIDTH), part.fixed
        speed = (part.targets - rows[fixed, :3]) / (part.substeps * part.time_step)
        part.v.reshape(-1, WIDTH)[fixed, :3] = speed
        inverse = inverse_masses(self.masses, fixed)
        _advance(*part[:5], inverse, self.potential.tables, self.potential.stiffness)
        rows[fixed, :3] = part.targets


@compiled(nogil=True)
def _advance(y, v, acceleration, step, substeps, inverse, tables, stiffness):
    pull, elastic = np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        for k in range(len(y)):
            y[k] += 0.5 * step * v[k]
        pull[:] = 0.0
        add_projections(tables, y, pull)
        multiply(stiffness, y, elastic)
        for i in range(len(inverse)):
            if inverse[i] > 0.0:
                for axis in range(3):
                    k = WIDTH * i + axis
                    force = pull[k] - elastic[k]
                    v[k] += step * (acceleration[axis] + inverse[i] * force)
        for k in range(len(y)):
            y[k] += 0.5 * step * v[k]
