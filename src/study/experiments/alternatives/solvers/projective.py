"""Projective dynamics in substeps: K iterations in each of n steps (Macklin et al. 2019: K = 1).

Three methods: plain, with Anderson acceleration (`pdrom.model.dynamics.acceleration`), and with
Chebyshev's semi-iteration (Wang 2015, alg. 1).
"""

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.dynamics.acceleration import Anderson, combine, forget, refuse
from pdrom.model.dynamics.frames import inertia_energy, weighted
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    add_projections,
    begin,
    end,
)

WINDOW = 5  # number of differences of earlier iterates, as in Peng et al. 2018
# The estimated rate of the plain iteration, and the number of iterations before extrapolation. Both
# are set by hand, as in Wang 2015: of five rates this one does best on the motions of both sheets
# in the comparison, which favours the method. A rate measured from the first iterates does worse.
RATE = 0.98
PLAIN = 5


class SmallSteps(Alternative):
    """The local/global iteration for all groups, with the system matrix of a substep."""

    name = "projective"

    def _advance(self, part: Substeps) -> None:
        _plain(*part, self.space.system.inertia, self.tables, self._factor(part))


@compiled(nogil=True)
def _plain(y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, tables, factor):
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


class Accelerated(Alternative):
    """Anderson acceleration over `WINDOW` iterates, for all groups."""

    name = "anderson"

    def _prepare(self, scene: Scene) -> None:
        self._history = Anderson(WINDOW)

    def _advance(self, part: Substeps) -> None:
        self._history.begin_frame(part.y.reshape(-1, WIDTH))
        inertia, tables = self.space.system.inertia, self.tables
        _anderson(*part, inertia, tables, self._factor(part), self._history.history)


@compiled(nogil=True)
def _anderson(
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
                # the last image is not extrapolated: its objective is known not to rise
                if k < iterations - 1:
                    combine(history, y)
        end(y, before, step, v)


class Chebyshev(Alternative):
    """Extrapolates each plain iterate from the iterate before the last, by a growing weight."""

    name = "chebyshev"

    def _advance(self, part: Substeps) -> None:
        _chebyshev(*part, self.space.system.inertia, self.tables, self._factor(part))


@compiled(nogil=True)
def _chebyshev(
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
