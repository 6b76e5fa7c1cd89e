"""The step loop in the coordinates of a position subspace, q = B z.

During a run, arrays have an entry per subspace coordinate, per vertex fixed by a boundary condition
or (in scenes with contacts) per "probe": a vertex at which contacts are detected.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg

from pdrom.core.errors import NotReducibleError, SolverError
from pdrom.model.dynamics.space import Space
from pdrom.model.dynamics.stepper import State
from pdrom.model.dynamics.system import require_accurate
from pdrom.model.effects import base
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns


class DenseElimination:
    """Reduced system without the fixed coordinates, solved by its explicit (small) inverse.

    SolverError if its matrix is not positive definite or is solved inaccurately.

    matrix : (K, K) matrix of the reduced system, kg/s^2
    fixed : (m,) indices of the coordinates with prescribed values, ascending
    """

    def __init__(self, matrix: np.ndarray, fixed: np.ndarray) -> None:
        self.free = np.setdiff1d(np.arange(len(matrix)), fixed)
        block = matrix[np.ix_(self.free, self.free)]
        try:
            factor = linalg.cho_factor(block)
        except linalg.LinAlgError as error:
            raise SolverError(f"reduced system of size {len(self.free)}: {error}") from error
        self._inverse = np.ascontiguousarray(linalg.cho_solve(factor, np.eye(len(self.free))))
        require_accurate(block, lambda rhs, out: np.matmul(self._inverse, rhs, out=out))
        self._coupling = np.ascontiguousarray(matrix[np.ix_(self.free, fixed)])
        self.fixed, self.targets = fixed, np.zeros((len(fixed), 3))
        self._load = np.zeros((len(self.free), 3))

    def set_targets(self, targets: np.ndarray) -> None:
        """Set the values ``targets`` (m, 3) of the subspace coordinates with indices `fixed`."""
        self.targets = targets
        self._load = self._coupling @ targets

    def solve(self, rhs: np.ndarray, y: np.ndarray) -> None:
        """Overwrite the free coordinates of ``y`` (K, 3) by the solution for ``rhs`` (K, 3)."""
        y[self.free] = self.solved(rhs)

    def solved(self, rhs: np.ndarray) -> np.ndarray:
        """Return the free coordinates (K', 3) that solve the system for ``rhs`` (K, 3)."""
        return self._inverse @ (rhs[self.free] - self._load)

    def response(self, inertia: np.ndarray) -> np.ndarray:
        """Return the matrix (K', K) that maps a prediction s (K, 3) to K' free coordinates.

        These solve the system for ``inertia`` s, with ``inertia`` B^T M B / h^2 (K, K). Fixed
        entries of s must be those of `set_targets`.
        """
        result = self._inverse @ inertia[self.free]
        result[:, self.fixed] -= self._inverse @ self._coupling
        return result

    def lift(self, rows: np.ndarray) -> np.ndarray:
        """Multiply (m, K') the columns `free` of ``rows`` (m, K) and matrix[free, free]^-1."""
        return rows[:, self.free] @ self._inverse


def require_effects(scene: Scene) -> None:
    """Raise NotReducibleError if ``scene`` has an effect that no position subspace can simulate."""
    for effect in (*scene.forces, *scene.boundaries, *scene.contacts):
        if not effect.in_subspace:
            raise NotReducibleError(
                f"scene '{scene.config.name}', effect '{effect.name}': needs all vertices in every "
                "frame, which a position subspace lacks; train with group and method instead"
            )


PROBES = 200  # largest number of probes, the vertices at which contacts are detected


class ReducedSpace(Space):
    """Forces, boundary conditions, contacts and system matrix in coordinates z (K, 3), q = B z.

    matrices : stiffness B^T S^T W S B (K, K) of each group, summed over all or sampled elements
    matrix : (K, K) system matrix A: inertia and stiffness
    inertia_matrix : (K, K) B^T M B / h^2
    forces : c (K, 3) and a, a number or (K, K), of each force: it accelerates by c + a v at the
        velocity v
    """

    def __init__(self, scene: Scene, columns: Columns, matrices: Sequence[np.ndarray]) -> None:
        require_effects(scene)
        h = scene.config.time_step
        self.columns = columns
        mass = columns.B.T @ (scene.masses[:, None] * columns.B)
        self._made, self._eliminated = {}, lambda fixed: DenseElimination(self.matrix, fixed)
        self.matrix = mass / h**2 + sum(matrices, np.zeros_like(mass))
        self.inertia_matrix = mass / h**2
        self.forces = [_reduce_force(force, columns, scene) for force in scene.forces]
        # these objects act like a `Boundary`, with coordinates instead of vertices
        self.boundaries = [_ReducedBoundary(b, columns) for b in scene.boundaries]
        self._contacts = [_ReducedContact(c, columns, scene) for c in scene.contacts]

    def acceleration(self, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        total = np.zeros_like(positions)
        for constant, rate in self.forces:
            total += constant
            total += rate @ velocities if np.ndim(rate) else rate * velocities
        return total

    @cached_property
    def affine(self) -> tuple[np.ndarray, float, np.ndarray]:
        """All forces' acceleration c + a v + R v at velocity v: c (K, 3), a, R (K, K) or empty."""
        constant, rate, rates = np.zeros((len(self.matrix), 3)), 0.0, np.zeros((0, 0))
        for own, factor in self.forces:
            constant += own
            if np.ndim(factor) == 0:
                rate += float(factor)
            else:
                rates = rates + factor if len(rates) else np.array(factor)
        return constant, rate, rates

    @property
    def whole_frames(self) -> bool:
        """Whether all contacts are floors, so that one compiled call can compute several frames."""
        return all(contact.height is not None for contact in self._contacts)

    def free_frames(self, path: np.ndarray) -> int:
        """Count frames in ``path`` (n, K, 3) before a probe (vertex) is below a floor."""
        first = len(path)
        for contact in self._contacts:
            first = contact.free_frames(path[:first])
        return first

    def inertia(self, s: np.ndarray) -> np.ndarray:
        return self.inertia_matrix @ s

    def inertia_energy(self, difference: np.ndarray) -> float:
        return 0.5 * float(np.sum(difference * (self.inertia_matrix @ difference)))

    def correct(self, y: np.ndarray, before: np.ndarray, frame: int) -> None:
        if not self._contacts:
            return
        held = base.held_vertices([b.boundary for b in self.boundaries], frame)
        for contact in self._contacts:
            contact.correct(y, before, held)


def coordinates(columns: Columns, masses: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Project ``field`` (N, 3) mass-orthogonally on ``columns``, (K, 3); ``masses`` (N,) kg."""
    return _mass_solve(columns, masses, columns.B.T @ (masses[:, None] * field))


def projector(columns: Columns, masses: np.ndarray) -> np.ndarray:
    """Return the matrix (K, N) of the mass-orthogonal projection on ``columns``."""
    return _mass_solve(columns, masses, (columns.B * masses[:, None]).T)


def _mass_solve(columns: Columns, masses: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """Return (B^T M B)^-1 ``rhs`` with the matrix B of ``columns``.

    B^T M B is scaled to a unit diagonal, as masses far from 1 kg would make it ill-conditioned.
    """
    mass = columns.B.T @ (masses[:, None] * columns.B)
    scale = 1.0 / np.sqrt(np.diag(mass))[:, None]
    return scale * linalg.solve(scale * mass * scale.T, scale * rhs, assume_a="pos")


def reduced_state(scene: Scene, columns: Columns, state: State | None = None) -> State:
    """Project ``state`` of ``scene`` (None: the initial one) on ``columns``."""
    state = state or scene.initial_state()
    q, v = (coordinates(columns, scene.masses, f) for f in (state.positions, state.velocities))
    return State(q, v, state.anchors)


def _reduce_force(force: base.Force, columns: Columns, scene: Scene) -> tuple[np.ndarray, Any]:
    """Return constant (K, 3) and rate of the acceleration constant + rate v at velocity v.

    The rate is a number, or a matrix (K, K) if vertices have different rates. NotReducibleError is
    raised for all other forces.
    """
    shape = scene.mesh.points.shape
    rng = np.random.default_rng(0)
    q, v = rng.standard_normal(shape), rng.standard_normal(shape)
    constant = np.broadcast_to(force.acceleration(scene.mesh.points, np.zeros(shape)), shape)
    found = force.acceleration(q, v)
    rate = float(np.sum((found - constant) * v) / np.sum(v * v))
    reduced = coordinates(columns, scene.masses, constant)
    if np.allclose(found, constant + rate * v, rtol=1e-12, atol=1e-12):
        return reduced, rate
    rates = (force.acceleration(q, np.ones(shape)) - constant)[:, :1]
    if not np.allclose(found, constant + rates * v, rtol=1e-12, atol=1e-12):
        raise NotReducibleError(f"effect '{force.name}' is not affine in the velocity")
    return reduced, coordinates(columns, scene.masses, rates * columns.B)


class _ReducedBoundary:
    """Boundary condition on coordinates that move only its vertices; ``shift`` moves targets, m."""

    def __init__(self, boundary: base.Boundary, columns: Columns) -> None:
        self.boundary = boundary
        self.active, self.takes_hold = boundary.active, boundary.takes_hold
        self._parts: dict[bytes, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
        self._columns, self.shift = columns, np.zeros(3)
        self.vertices = np.unique(np.concatenate([np.empty(0, np.int64), *boundary.units()]))

    def held(self, frame: int) -> np.ndarray:
        """Return ascending indices of coordinates that move the vertices held in ``frame``."""
        return self._of(frame)[0]

    def anchor(self, frame: int, positions: np.ndarray) -> np.ndarray:
        """Return positions (n, 3) m of vertices held in ``frame``, from coordinates (K, 3)."""
        indices, rows, _ = self._of(frame)
        return rows @ positions[indices]

    def path(self, frames: range, anchor: np.ndarray) -> np.ndarray:
        """Return values (n, m, 3) in ``frames`` of coordinates `held`; see `base.Boundary.path`."""
        return self._of(frames.start)[2] @ (self.boundary.path(frames, anchor) + self.shift)

    def _of(self, frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Indices i of coordinates prescribed in ``frame``, R = B[held vertices, i]; pinv(R)."""
        vertices = self.boundary.held(frame)
        key = vertices.tobytes()
        if key not in self._parts:
            held = set(vertices.tolist())
            atoms = zip(self._columns.atoms, self._columns.atom_columns, strict=True)
            touched = [own for atom, own in atoms if int(atom[0]) in held]
            indices = np.sort(np.concatenate(touched))
            rows = self._columns.B[np.ix_(vertices, indices)]
            self._parts[key] = indices, rows, np.linalg.pinv(rows)
        return self._parts[key]


def probe_vertices(n: int) -> np.ndarray:
    """Choose probes: vertices, of n, at which contacts are detected, ascending."""
    return np.unique(np.linspace(0, n - 1, min(PROBES, n)).round().astype(np.int64))


class _ReducedContact:
    """Contact that is detected at probe vertices and then resolved at all vertices."""

    def __init__(self, contact: base.Contact, columns: Columns, scene: Scene) -> None:
        self._contact, self.height = contact, contact.height
        self._vertices = probe_vertices(scene.mesh.vertices)
        self._probes = np.ascontiguousarray(columns.B[self._vertices])
        self._columns = columns
        self._project = projector(columns, scene.masses)
        self._held: dict[bytes, np.ndarray] = {}

    def free_frames(self, path: np.ndarray) -> int:
        """Count frames in ``path`` (n, K, 3) before a probe (vertex) is below this floor."""
        lowest = (path[:, :, 1] @ self._probes.T).min(axis=1)
        # a frame with non-finite coordinates counts as one with contact
        above = lowest >= self.height
        return len(path) if above.all() else int(np.argmin(above))

    def correct(self, y: np.ndarray, before: np.ndarray, held: np.ndarray) -> None:
        probed = self._probes @ y
        corrected = probed.copy()
        if (key := held.tobytes()) not in self._held:
            self._held[key] = np.flatnonzero(np.isin(self._vertices, held))
        self._contact.apply(corrected, self._probes @ before, self._held[key])
        if np.array_equal(probed, corrected):
            return
        # fixed y do not change: only held vertices depend on them, and contacts do not move these
        if self.height is not None:  # a floor lifts the vertices below it, and leaves all others
            heights = self._columns.B @ y[:, 1]
            low = np.setdiff1d(np.flatnonzero(heights < self.height), held)
            y[:, 1] += self._project[:, low] @ (self.height - heights[low])
            return
        full = self._columns.B @ y
        self._contact.apply(full, self._columns.B @ before, held)
        y[...] = self._project @ full
