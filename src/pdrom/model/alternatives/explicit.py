"""Explicit integration by position Verlet: half a drift, a kick, half a drift.

Of second order and symplectic (Tuckerman et al. 1992), with one evaluation of the forces a substep.
Stable while the substep is shorter than 2 / omega of the stiffest mode.
"""

import numpy as np

from pdrom.model.alternatives.potential import add_projections, multiply
from pdrom.model.alternatives.substeps import Alternative, inverse_masses
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH


class Explicit(Alternative):
    """Substeps without a system of equations, for all groups; ``iterations`` mean nothing."""

    name = "explicit"

    def _advance(
        self,
        y: np.ndarray,
        v: np.ndarray,
        acceleration: np.ndarray,
        fixed: np.ndarray,
        targets: np.ndarray,
        substeps: int,
    ) -> None:
        rows = y.reshape(-1, WIDTH)
        speed = (targets - rows[fixed, :3]) / (substeps * self.time_step)
        v.reshape(-1, WIDTH)[fixed, :3] = speed
        _advance(
            y, v, acceleration, self.time_step, substeps, inverse_masses(self.masses, fixed),
            self.potential.tables, self.potential.stiffness,
        )  # fmt: skip
        rows[fixed, :3] = targets


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
