"""Largest rise of the computed objective in an iteration by rounding alone.

In exact arithmetic 1/(2h^2) |M^1/2 (y - s)|^2 + sum_j W_j(y) falls in every iteration. What is
computed differs in two ways (u = eps, c a small constant for the length of the sums):

- evaluation: y - s and S y - p are wrong by c u (|y| + |s|) and c u (|S| |y| + |p|). With R the
  objective of these errors alone, a value E is wrong by at most 2 sqrt(E R) + R (Cauchy-Schwarz);
- solution: y is no exact minimiser of the quadratic of the global step, and misses its minimum by
  d^T A d / 2 for an error d. A Cholesky solve leaves a residual |r| <= c u |A| |y| (Higham 2002,
  theorem 10.4), hence at most |r|^2 / (2 lambda_min(A)). In a subspace the right-hand side is
  wrong by as much in the vertices, so that r <= c u |B|^T |A| |y|, and the explicit inverse adds
  d <= c u cond(A) |z|, where the scaling of the columns does not count.

lambda_min is bounded by the smallest mass over h^2, as if nothing were held: where masses are
round-off compared with the weights and pins alone make the system solvable, the bound means little.
"""

from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns

EPS = np.finfo(float).eps
# A row of S or A has about 10 entries, and each value passes through a few further operations.
OPERATIONS = 32.0


@dataclass(frozen=True)
class Roundoff:
    """Rounding of one step loop.

    columns : map B (N, K) from its coordinates to vertices; None: its coordinates are the vertices
    """

    scene: Scene
    loop: Stepper
    columns: Columns | None = None

    def allowance(self, before: State, after: State, first: float) -> float:
        """Largest rise in joule that rounding explains, in a frame with first objective ``first``.

        Coordinates of the frame's beginning, ``before``, and end, ``after``, bound the iterates'.
        """
        h = self.loop.time_step
        acceleration = self.loop.space.acceleration(before.positions, before.velocities)
        s = before.positions + h * before.velocities + h**2 * acceleration
        largest = np.max(np.abs([before.positions, s, after.positions]), axis=0)
        size = largest if self.columns is None else np.abs(self.columns.B) @ largest
        size = float(size.max()) + float(np.abs(self.scene.mesh.points).max())
        noise = self._noise(size)
        evaluation = 2.0 * np.sqrt(abs(first) * noise) + noise
        if self.columns is None:
            return evaluation + self._sparse(size)
        return evaluation + self._dense(self.columns, size, largest)

    def _noise(self, size: float) -> float:
        """R: the objective of rounding errors where all coordinates are of ``size``."""
        h = self.loop.time_step
        unit = OPERATIONS * EPS * size
        total = 1.5 * float(self.scene.masses.sum()) / h**2 * (2.0 * unit) ** 2
        for group in self.scene.groups:
            rows = np.asarray(abs(group.S).sum(axis=1)).ravel()
            total += 1.5 * float(group.row_weights @ (2.0 * rows * unit) ** 2)
        return total

    def _residual(self, size: float) -> np.ndarray:
        """c u |A| |y| of the vertices, (N,)."""
        rows = np.asarray(abs(self.scene.system.matrix).sum(axis=1)).ravel()
        return OPERATIONS * EPS * size * rows

    def _sparse(self, size: float) -> float:
        residual = self._residual(size)
        smallest = float(self.scene.system.inertia.min())
        return 1.5 * float(residual @ residual) / smallest

    def _dense(self, columns: Columns, size: float, largest: np.ndarray) -> float:
        b = columns.B
        matrix = b.T @ (self.scene.masses[:, None] * b) / self.loop.time_step**2
        matrix = matrix + sum(step.matrix for step in self.loop.local_steps)
        # coordinates may have different sizes, which does not change the condition: columns are
        # scaled to length one
        scale = np.sqrt(np.diag(matrix))
        eigenvalues = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        smallest, greatest = max(eigenvalues[0], EPS * eigenvalues[-1]), eigenvalues[-1]
        coordinates = float(np.linalg.norm(scale[:, None] * largest))
        error = OPERATIONS * EPS * greatest / smallest * coordinates
        residual = (np.abs(b).T @ self._residual(size)) / scale
        return float(1.5 * (residual @ residual) / smallest + 0.5 * greatest * error**2)
