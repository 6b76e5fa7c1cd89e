"""The local/global iteration with Anderson acceleration, all iterations of a frame compiled.

See `pdrom.model.dynamics.acceleration`; here a frame may have substeps.
"""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.dynamics.acceleration import Anderson, combine, forget, refuse
from pdrom.model.dynamics.frames import inertia_energy, weighted
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.potential import add_projections
from study.experiments.alternatives.solvers.substeps import Alternative, Substeps, begin, end

WINDOW = 5  # differences of earlier iterates, as in the paper


class Accelerated(Alternative):
    """Anderson acceleration over `WINDOW` iterates, for all groups."""

    name = "anderson"

    def _prepare(self, scene: Scene) -> None:
        self._history = Anderson(WINDOW)

    def _advance(self, part: Substeps) -> None:
        self._history.begin_frame(part.y.reshape(-1, WIDTH))
        inertia, tables = self.space.system.inertia, self.potential.tables
        _advance(*part, inertia, tables, self._factor(part), self._history.history)


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, tables, factor, history
):
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        forget(history)
        for k in range(iterations):
            rhs[:] = base
            objective = add_projections(tables, y, rhs) + inertia_energy(y, s, inertia)
            if not refuse(history, y, objective):
                sweep(panels, vertices, loads, work, rhs, y)
                # the last image stays as it is: its objective is known not to rise
                if k < iterations - 1:
                    combine(history, y)
        end(y, before, step, v)
