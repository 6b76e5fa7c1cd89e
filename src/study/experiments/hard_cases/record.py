"""The record of one run of a hard case, a bound on its rounding errors, and the checks.

In exact arithmetic 1/(2h^2) |M^1/2 (y - s)|^2 + sum_j W_j(y) falls in every iteration. Computed
values differ for two reasons (u = eps, c a small constant for the length of the sums):

- evaluation: y - s and S y - p are wrong by c u (|y| + |s|) and c u (|S| |y| + |p|). With R the
  objective of these errors alone, a value E is wrong by at most 2 sqrt(E R) + R (Cauchy-Schwarz);
- solution: the global step misses the minimum of its quadratic by d^T A d / 2 for an error d of y.
  A Cholesky solve leaves a residual |r| <= c u |A| |y| (Higham 2002, theorem 10.4), so that this
  is at most |r|^2 / (2 lambda_min(A)). In a subspace the right-hand side has the same error in the
  vertices, so that r <= c u |B|^T |A| |y|, and the explicit inverse adds d <= c u cond(A) |z|,
  where A has columns scaled to length one.

lambda_min is bounded from below by the smallest mass over h^2, without pins: where masses are
round-off compared with the weights, and only pins make A regular, the bound is very loose.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdrom.core.errors import PdromError
from pdrom.model.dynamics.stepper import FrameReport, LocalStep, State, Stepper
from pdrom.model.metrics import shape_residuals
from pdrom.model.runs import BoundedRun, frame_by_frame
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.model import SubspaceModel
from study.experiments.hard_cases.case import HardCase

EPS = np.finfo(float).eps
# A row of S or A has about 10 entries, and each value passes through a few further operations.
OPERATIONS = 32.0
# Largest distance from the rest shape, over the extent, of a shape that counts as recovered.
RECOVERED = 1e-2


@dataclass(frozen=True)
class Roundoff:
    """Largest rise of the objective of one step loop by rounding alone.

    basis : B (N, K) of the positions B z; None if the coordinates of ``loop`` are the positions
    """

    scene: Scene
    loop: Stepper
    basis: np.ndarray | None = None

    def allowance(self, before: State, after: State, first: float) -> float:
        """Largest rise by rounding, in joule, in a frame with first objective ``first``.

        The size of the iterates is estimated by the states ``before`` and ``after`` the frame.
        """
        h = self.loop.time_step
        acceleration = self.loop.space.acceleration(before.positions, before.velocities)
        s = before.positions + h * before.velocities + h**2 * acceleration
        largest = np.max(np.abs([before.positions, s, after.positions]), axis=0)
        size = largest if self.basis is None else np.abs(self.basis) @ largest
        size = float(size.max()) + float(np.abs(self.scene.mesh.points).max())
        noise = self._noise(size)
        evaluation = 2.0 * np.sqrt(abs(first) * noise) + noise
        if self.basis is None:
            residual = self._residual(size)
            smallest = float(self.scene.system.inertia.min())
            return evaluation + 1.5 * float(residual @ residual) / smallest
        return evaluation + self._dense(self.basis, size, largest)

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

    def _dense(self, b: np.ndarray, size: float, largest: np.ndarray) -> float:
        matrix = b.T @ (self.scene.masses[:, None] * b) / self.loop.time_step**2
        steps: Sequence[Any] = self.loop.local_steps  # in a subspace each has a matrix
        matrix = matrix + sum(step.matrix for step in steps)
        # columns are scaled to length one: the sizes of the coordinates do not matter
        scale = np.sqrt(np.diag(matrix))
        eigenvalues = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        smallest, greatest = max(eigenvalues[0], EPS * eigenvalues[-1]), eigenvalues[-1]
        coordinates = float(np.linalg.norm(scale[:, None] * largest))
        error = OPERATIONS * EPS * greatest / smallest * coordinates
        residual = (np.abs(b).T @ self._residual(size)) / scale
        return float(1.5 * (residual @ residual) / smallest + 0.5 * greatest * error**2)


@dataclass(frozen=True)
class Record:
    """A run, frame by frame; it ends before the first frame that is not finite.

    positions, velocities : (F + 1, N, 3) m and m/s, the start first
    rise : (F,) largest rise of the objective from one iteration to the next over the frame's first
        objective, zero if it never rose
    excess : (F,) that rise minus the largest rise by rounding alone, J
    energy : (F + 1,) sum of the kinetic energy and the potential energy of the groups, J
    blowup_frame : first frame that is not finite or too large, None if there is none
    """

    positions: np.ndarray
    velocities: np.ndarray
    rise: np.ndarray
    excess: np.ndarray
    energy: np.ndarray
    blowup_frame: int | None

    @property
    def extent(self) -> float:
        """Largest side of the bounding box in any frame, m."""
        return float(np.ptp(self.positions, axis=1).max())


class Watched:
    """A reduced local step that reports the energy of the full projections as its own."""

    def __init__(self, step: LocalStep, group: LocalStep) -> None:
        self.name = step.name
        self._step, self._group = step, group

    def begin_frame(self, q: np.ndarray) -> None:
        """Freeze the frame's data of the reduced step and of the group at ``q`` (N, 3) m."""
        self._step.begin_frame(q)
        self._group.begin_frame(q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the reduced S^T W p at ``y`` (N, 3) m to ``rhs`` (N, 3); return the full energy J."""
        self._step.accumulate(y, rhs)
        return self._group.accumulate(y, np.zeros_like(y))


def record(
    scene: Scene,
    loop: Stepper,
    state: State,
    model: SubspaceModel | None = None,
    limit: float = np.inf,
    observe: Callable[[int, np.ndarray], None] | None = None,
) -> Record:
    """Run all frames of ``scene`` with ``loop`` from ``state``.

    Parameters
    ----------
    model : the position subspace of ``loop``; None if its coordinates are the positions
    limit : extent in metres at which the run ends as a blow-up
    observe : called with the number and the last local iterate of every frame
    """
    roundoff = Roundoff(scene, loop, None if model is None else model.columns.B)
    positions: Callable[[np.ndarray], np.ndarray] = model.positions if model else lambda y: y
    states, rises, excesses = [(positions(state.positions), positions(state.velocities))], [], []

    def advance(before: State, frame: int) -> tuple[State, FrameReport]:
        watch = None if observe is None else (lambda y: observe(frame, y))
        return loop.step(before, frame, watch)

    run = BoundedRun(
        frame_by_frame(advance), state, scene.config.frames, limit, positions=positions
    )
    for frame in run:
        before, after, report = state, frame.state, frame.report
        with np.errstate(over="ignore", invalid="ignore"):
            v = positions(after.velocities)
        if not np.isfinite(v).all():
            run.blowup_frame = frame.number
            break
        largest = float(np.diff(report.objective).max(initial=0.0))
        first = float(report.objective[0])
        rises.append(largest / first if first > 0.0 else 0.0)
        excesses.append(largest - roundoff.allowance(before, after, first))
        states.append((frame.positions, v))
        state = after
    energies = []
    with np.errstate(over="ignore", invalid="ignore"):
        for q, v in states:
            kinetic = 0.5 * float(scene.masses @ (v**2).sum(axis=1))
            for group in scene.groups:
                group.begin_frame(q)
            groups = sum(group.accumulate(q, np.zeros_like(q)) for group in scene.groups)
            energies.append(kinetic + groups)
    q, v = (np.stack(parts) for parts in zip(*states, strict=True))
    rise, excess, total = (np.array(values) for values in (rises, excesses, energies))
    return Record(q, v, rise, excess, total, run.blowup_frame)


def full_order(
    case: HardCase, scene: Scene, observe: Callable[[int, np.ndarray], None] | None = None
) -> Record:
    """Run ``scene`` of ``case`` from its start; ``observe`` as in `record`."""
    return record(scene, scene.stepper(), case.start(scene), observe=observe)


Check = Callable[[HardCase, Scene, Record], str]


def finite(case: HardCase, scene: Scene, run: Record) -> str:
    """Every frame is there and finite."""
    whole = len(run.positions) == scene.config.frames + 1
    return "" if whole else f"not finite in frame {run.blowup_frame}"


def bounded(case: HardCase, scene: Scene, run: Record) -> str:
    """The extent stays below the case's bound."""
    limit = case.bound * reach(scene, run)
    return "" if run.extent <= limit else f"extent {run.extent:.3g} m, allowed {limit:.3g} m"


def reach(scene: Scene, run: Record) -> float:
    """Largest extent of rest, start and held vertices, m."""
    sizes = [scene.mesh.extent, float(np.ptp(run.positions[0], axis=0).max())]
    held = np.unique(np.concatenate([[], *(b.vertices for b in scene.boundaries)]).astype(int))
    if len(held):
        sizes.append(float(np.ptp(run.positions[:, held], axis=1).max()))
    return max(sizes)


def objective(case: HardCase, scene: Scene, run: Record) -> str:
    """No iteration raises the objective by more than rounding explains."""
    worst = int(np.argmax(run.excess))
    if run.excess[worst] <= 0.0:
        return ""
    return f"objective rises by {run.rise[worst]:.1e} of its value in frame {worst}"


def energy(case: HardCase, scene: Scene, run: Record) -> str:
    """Kinetic plus potential energy never exceeds its value at the start.

    From rest the first frame obeys this for every K, since its objective is this energy; later
    frames obey it by the damping of the implicit step.
    """
    start, largest = run.energy[0], run.energy.max()
    elastic = float(np.abs(run.positions).max()) ** 2 * float(abs(scene.system.matrix).sum())
    noise = EPS * OPERATIONS * elastic
    ok = largest <= start * (1.0 + 1e-9) + noise
    return "" if ok else f"energy grows from {start:.3g} J to {largest:.3g} J"


def momentum(case: HardCase, scene: Scene, run: Record) -> str:
    """Linear momentum changes by gravity only."""
    h, masses = scene.config.time_step, scene.masses
    pull = sum((f.acceleration(run.positions[0], run.velocities[0]) for f in scene.forces), 0.0)
    frames = np.arange(len(run.velocities))[:, None]
    found = np.einsum("n,fna->fa", masses, run.velocities)
    expected = found[0] + frames * h * masses.sum() * np.broadcast_to(pull, 3)
    error = np.abs(found - expected).max()
    # the columns of S^T W p and of the residual of the solve sum to zero up to rounding
    size = float(np.abs(run.positions).max()) + float(np.abs(run.velocities).max()) * h
    noise = EPS * OPERATIONS * size * (masses.sum() / h + h * abs(scene.system.matrix).sum())
    allowed = noise * max(1.0, np.sqrt(len(found)))
    if error <= allowed:
        return ""
    return f"momentum is off by {error:.1e}, allowed {allowed:.1e} kg m/s"


def determinism(case: HardCase, scene: Scene, run: Record) -> str:
    """A second run gives the same bits."""
    again = full_order(case, case.scene())
    same = np.array_equal(run.positions, again.positions)
    return "" if same and np.array_equal(run.rise, again.rise) else "a second run differs"


def recovers(case: HardCase, scene: Scene, run: Record) -> str:
    """The run ends in the rest shape, up to a rigid motion."""
    residuals, scale = shape_residuals(scene.mesh.points[None], run.positions[-1:])
    error = scale[0] * float(np.linalg.norm(residuals, axis=2).max()) / scene.mesh.extent
    return "" if error <= RECOVERED else f"ends {error:.2g} extents from its rest shape"


def still(case: HardCase, scene: Scene, run: Record) -> str:
    """Nothing moves."""
    moved = float(np.abs(run.positions - run.positions[0]).max())
    allowed = 1e-9 * float(np.abs(run.positions[0]).max())
    return "" if moved <= allowed else f"moves by {moved:.1e} m"


CHECKS: dict[str, Check] = {
    check.__name__: check
    for check in (finite, bounded, objective, energy, momentum, determinism, recovers, still)
}


def faults(case: HardCase) -> list[str]:
    """Return the checks that the full-order run of ``case`` fails, each with its reason.

    For a case that must be refused, building or running the scene must raise a `PdromError`.
    """
    if case.holds == ("refused",):
        try:
            full_order(case, case.scene())
        except PdromError:
            return []
        return ["was not refused"]
    scene = case.scene()
    run = full_order(case, scene)
    found = {name: CHECKS[name](case, scene, run) for name in case.holds}
    return [f"{name}: {fault}" for name, fault in found.items() if fault]
