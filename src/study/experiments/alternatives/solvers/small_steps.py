"""Projective dynamics in substeps: K iterations in each of n steps (Macklin et al. 2019: K = 1)."""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.dynamics.frames import weighted
from pdrom.model.dynamics.sweeps import sweep
from study.experiments.alternatives.solvers.potential import add_projections
from study.experiments.alternatives.solvers.substeps import Alternative, Substeps, begin, end


class SmallSteps(Alternative):
    """The local/global iteration for all groups; its matrix is that of the substep."""

    name = "projective"

    def _advance(self, part: Substeps) -> None:
        _advance(*part, self.space.system.inertia, self.potential.tables, self._factor(part))


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, tables, factor
):
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        for _ in range(iterations):
            rhs[:] = base
            add_projections(tables, y, rhs)
            sweep(panels, vertices, loads, work, rhs, y)
        end(y, before, step, v)
