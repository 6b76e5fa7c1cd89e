"""Explicit integration by position Verlet: half a drift, a kick, half a drift.

Of second order and symplectic (Tuckerman et al. 1992), with one evaluation of the forces a substep.
Stable while the substep is shorter than 2 / omega of the stiffest mode.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pdrom.model.compiled.arithmetic import add_scaled, constant
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at, load, store
from pdrom.model.scene import Scene
from study.experiments.alternatives.solvers.substeps import Alternative, Substeps, add_projections
from study.experiments.kit.scenes import followed

UNSTABLE = 1e100  # m; a run that is larger, or not finite, is called unstable


class Explicit(Alternative):
    """Substeps without a system of equations, for all groups; ``iterations`` have no effect."""

    name = "explicit"

    def _prepare(self, scene: Scene) -> None:
        total = sparse.csr_array((len(self.masses), len(self.masses)))
        for group in scene.groups:
            total = total + group.system_matrix()
        total.sort_indices()
        # S^T W S of all groups, as `_multiply` takes it
        self._stiffness = *(i.astype(np.int32) for i in (total.indptr, total.indices)), total.data

    def _advance(self, part: Substeps) -> None:
        rows, fixed = part.y.reshape(-1, WIDTH), part.fixed
        speed = (part.targets - rows[fixed, :3]) / (part.substeps * part.time_step)
        part.v.reshape(-1, WIDTH)[fixed, :3] = speed
        inverse = 1.0 / self.masses
        inverse[fixed] = 0.0  # fixed vertices are not accelerated
        _advance(*part[:5], inverse, self.tables, self._stiffness)
        rows[fixed, :3] = part.targets


@compiled(nogil=True)
def _advance(y, v, acceleration, step, substeps, inverse, tables, stiffness):
    pull, elastic = np.empty(len(y)), np.empty(len(y))
    for _ in range(substeps):
        for k in range(len(y)):
            y[k] += 0.5 * step * v[k]
        pull[:] = 0.0
        add_projections(tables, y, pull)
        _multiply(stiffness, y, elastic)
        for i in range(len(inverse)):
            if inverse[i] > 0.0:
                for axis in range(3):
                    k = WIDTH * i + axis
                    force = pull[k] - elastic[k]
                    v[k] += step * (acceleration[axis] + inverse[i] * force)
        for k in range(len(y)):
            y[k] += 0.5 * step * v[k]


@compiled(nogil=True)
def _multiply(matrix, y, out):
    """Overwrite ``out`` by the matrix (CSR) times ``y``, both padded vectors, flat."""
    indptr, indices, data = matrix
    for i in range(len(indptr) - 1):
        total = constant(0.0)
        for k in range(at(indptr, i), at(indptr, i + 1)):
            total = add_scaled(total, at(data, k), load(y, WIDTH * at(indices, k)))
        store(out, WIDTH * i, total)


@dataclass(frozen=True)
class Continuous:
    """Positions (F + 1, N, 3) m at the ends of frames, the initial ones first.

    error : estimate of || Q - Q_exact || / || Q - Q_0 ||, from the change by the last halving
    substeps : number of explicit steps of a frame
    """

    positions: np.ndarray
    error: float
    substeps: int


def continuous(
    scene: Scene, frames: int, tolerance: float, substeps: int, limit: int
) -> Continuous:
    """Run ``frames`` of ``scene`` by explicit steps, halved until the error is small.

    Parameters
    ----------
    tolerance : estimated relative error that ends the halving
    substeps : number of substeps of a frame in the first run
    limit : largest number of substeps of a frame; the last run is returned, whatever its error
    """
    start, before, last = scene.initial_state(), None, np.inf
    while True:
        after = followed(Explicit(scene, substeps), start, frames)
        if before is not None:
            change = _change(before, after)
            # Richardson's estimate of the remaining error: a third of the last change where changes
            # fall to a quarter, as with a method of second order; the whole change where they do
            # not fall to a half, because the motion is not smooth or not yet resolved
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
