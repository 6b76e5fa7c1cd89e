"""The limit K -> infinity of the step loop: every frame solved to the minimum of its objective.

The local/global iteration converges linearly and slowly on stiff meshes. It is a quasi-Newton step
with the constant system matrix A for a Hessian, so that L-BFGS started from A (Liu, Bouaziz and
Kavan 2017, section 4) has the same stationary points and reaches them in far fewer evaluations.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.scene import Scene
from study.experiments.kit.scenes import followed

MEMORY = 8
SUFFICIENT = 1e-4  # Armijo's constant
SHORTEST = 1e-4  # a shorter step is given up for a plain iteration, which cannot rise

Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]


class Minimum(NamedTuple):
    """End of a minimisation.

    y : (n, 3) last iterate
    change : largest entry by which one more local/global iteration would move it, m
    evaluations : local and global steps done
    """

    y: np.ndarray
    change: float
    evaluations: int


def minimise(
    evaluate: Evaluate, matrix: sparse.csr_array, y: np.ndarray, tolerance: float, limit: int
) -> Minimum:
    """L-BFGS in the metric of ``matrix``, with backtracking on the objective.

    Parameters
    ----------
    evaluate : y -> objective and the result G(y) of one local/global iteration; the gradient is
        A (y - G(y)), and G(y) equals y on fixed rows
    matrix : A, (n, n) symmetric positive definite
    y : (n, 3) m where it starts
    tolerance : the end is reached when no entry of G(y) - y is larger, m
    limit : evaluations allowed
    """
    pairs: list[_Pair] = []
    objective, target = evaluate(y)
    d, evaluations = target - y, 1
    while np.abs(d).max(initial=0.0) > tolerance and evaluations < limit:
        direction = _direction(d, pairs)
        slope = -float(np.vdot(matrix @ d, direction))
        if slope >= 0.0:
            pairs, direction = [], d
            slope = -float(np.vdot(matrix @ d, d))
        step, noise = 1.0, 8.0 * np.finfo(float).eps * abs(objective)
        while True:
            trial = y + step * direction
            value, target = evaluate(trial)
            evaluations += 1
            if value <= objective + SUFFICIENT * step * slope + noise:
                break
            step *= 0.5
            if step < SHORTEST:
                trial, pairs = y + d, []
                value, target = evaluate(trial)
                evaluations += 1
                break
        after = target - trial
        moved, change = trial - y, d - after
        both = matrix @ np.hstack([moved, change])
        a_moved, a_change = both[:, :3].copy(), both[:, 3:].copy()  # in one piece: read often
        curvature = float(np.vdot(moved, a_change))
        if curvature > 0.0:
            pairs = [*pairs, _Pair(moved, change, a_moved, a_change, curvature)][-MEMORY:]
        y, d, objective = trial, after, value
    return Minimum(y, float(np.abs(d).max(initial=0.0)), evaluations)


class _Pair(NamedTuple):
    """A step and the change of A^-1 gradient along it, each also multiplied by A."""

    step: np.ndarray
    change: np.ndarray
    a_step: np.ndarray
    a_change: np.ndarray
    curvature: float


def _direction(d: np.ndarray, pairs: list[_Pair]) -> np.ndarray:
    """The two-loop recursion (Nocedal 1980) for q = A^-1 gradient in place of the gradient."""
    q, alphas = d.copy(), []
    for pair in reversed(pairs):
        alpha = np.vdot(pair.a_step, q) / pair.curvature
        q -= alpha * pair.change
        alphas.append(alpha)
    for pair, alpha in zip(pairs, reversed(alphas), strict=True):
        q += (alpha - np.vdot(pair.a_change, q) / pair.curvature) * pair.step
    return q


class ConvergedStepper(Stepper):
    """The step loop of a full-order scene with as many iterations as the minimum needs.

    ``changes`` and ``evaluations`` hold one number per frame done so far (see `Minimum`).
    """

    def __init__(self, scene: Scene, system: GlobalSystem, tolerance: float, limit: int) -> None:
        super().__init__(scene.space(system), scene.config.time_step, limit, scene.groups)
        self.space: VertexSpace
        self._tolerance = tolerance * scene.mesh.extent
        self.changes: list[float] = []
        self.evaluations: list[int] = []

    @property
    def converged(self) -> bool:
        """Whether every frame reached the tolerance."""
        return all(change <= self._tolerance for change in self.changes)

    def step(
        self, state: State, frame: int, on_last_iterate: Callable[[np.ndarray], None] | None = None
    ) -> tuple[State, FrameReport]:
        """Do ``frame`` from ``state``; no objective, and no iterate for ``on_last_iterate``."""
        s, elimination, base = self._begin(state, frame)
        rhs = np.empty_like(s)

        def evaluate(y: np.ndarray) -> tuple[float, np.ndarray]:
            np.copyto(rhs, base)
            energy = sum(local.accumulate(y, rhs) for local in self.local_steps)
            target = y.copy()
            elimination.solve(rhs, target)
            return energy + self.space.inertia_energy(y - s), target

        end = minimise(
            evaluate, self.space.system.matrix, s, tolerance=self._tolerance, limit=self.iterations
        )
        self.changes.append(end.change)
        self.evaluations.append(end.evaluations)
        return self._finish(state, end.y, frame), FrameReport(np.empty(0), np.zeros(4))


def converged_run(scene: Scene, tolerance: float, limit: int) -> np.ndarray | None:
    """Positions (F + 1, N, 3) m of a run of ``scene`` in converged frames, the initial ones first.

    None where a frame does not reach the ``tolerance`` in ``limit`` evaluations.
    """
    best = ConvergedStepper(scene, scene.system, tolerance, limit)
    positions = followed(best, scene.initial_state(), scene.config.frames)
    return positions if best.converged else None
