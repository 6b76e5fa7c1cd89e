"""Explicit integration by position Verlet: half a drift, a kick, half a drift.

Of second order and symplectic (Tuckerman et al. 1992), with one evaluation of the forces a substep.
Stable while the substep is shorter than 2 / omega of the stiffest mode.
"""

from dataclasses import dataclass

import numpy as np

from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    add_projections,
    inverse_masses,
    multiply,
)
from study.experiments.kit.scenes import followed

UNSTABLE = 1e100  # m; of a larger run, or one that is not finite, no change is estimated


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


@dataclass(frozen=True)
class Continuous:
    """Positions (F + 1, N, 3) m at the ends of frames, the initial ones first.

    error : estimate of || Q - Q_exact || / || Q - Q_0 ||, from the change by the last halving
    substeps : explicit steps of a frame
    """

    positions: np.ndarray
    error: float
    substeps: int


def continuous(
    scene: Scene, frames: int, tolerance: float, substeps: int, limit: int
) -> Continuous:
    """Explicit steps through so many ``frames`` of ``scene``, halved until the error is small.

    Parameters
    ----------
    tolerance : estimated relative error that ends the halving
    substeps : of a frame, to begin with; an unstable run is halved like an inaccurate one
    limit : on the substeps; the last run is returned, whatever its error
    """
    start, before, last = scene.initial_state(), None, np.inf
    while True:
        after = followed(Explicit(scene, substeps), start, frames)
        if before is not None:
            change = _change(before, after)
            # Richardson's estimate of what remains: a third of the last change where changes fall
            # to a quarter, as with a method of second order; all of it where they do not fall to a
            # half, because the motion is not smooth or not yet resolved
            ratio = last / change if change > 0.0 and np.isfinite(last) else 1.0
            error = change / min(max(ratio - 1.0, 1.0), 3.0)
            if error <= tolerance or 2 * substeps > limit:
                return Continuous(after, error, substeps)
            last = change
        before, substeps = after, 2 * substeps


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Relative change of a run; inf if one of them is unstable."""
    if not max(np.abs(before).max(), np.abs(after).max()) < UNSTABLE:
        return float("inf")
    difference, moved = np.linalg.norm(after - before), np.linalg.norm(after - after[0])
    return float(difference / moved) if moved > 0.0 else 0.0
