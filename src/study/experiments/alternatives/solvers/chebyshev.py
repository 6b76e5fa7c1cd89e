"""The local/global iteration with Chebyshev's semi-iteration (Wang 2015, alg. 1)."""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.dynamics.frames import weighted
from pdrom.model.dynamics.sweeps import sweep
from study.experiments.alternatives.solvers.potential import add_projections
from study.experiments.alternatives.solvers.substeps import Alternative, Substeps, begin, end

# The rate of the plain iteration and their number before the first extrapolation are set by hand,
# as in the paper: of five rates this one does best on the motions of both sheets on which it is
# compared, which favours it. A rate measured from the first iterates does worse.
RATE = 0.98
PLAIN = 5


class Chebyshev(Alternative):
    """Each iterate is moved beyond the plain one, by a weight that grows with the iterations."""

    name = "chebyshev"

    def _advance(self, part: Substeps) -> None:
        _advance(*part, self.space.system.inertia, self.potential.tables, self._factor(part))


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, tables, factor
):
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    last, image = np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        weight = 1.0
        last[:] = y
        for k in range(iterations):
            rhs[:] = base
            add_projections(tables, y, rhs)
            image[:] = y
            sweep(panels, vertices, loads, work, rhs, image)
            if k == PLAIN:
                weight = 2.0 / (2.0 - RATE * RATE)
            elif k > PLAIN:
                weight = 4.0 / (4.0 - RATE * RATE * weight)
            for j in range(len(y)):
                held = y[j]
                y[j] = weight * (image[j] - last[j]) + last[j]
                last[j] = held
        end(y, before, step, v)
