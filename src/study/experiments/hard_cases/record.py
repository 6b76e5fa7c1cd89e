"""One run of a hard case, watched from the outside, and what rounding explains of it.

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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdrom.core.errors import PdromError
from pdrom.model.dynamics.stepper import FrameReport, LocalStep, State, Stepper
from pdrom.model.metrics import shape_residuals
from pdrom.model.runs import BoundedRun, frame_by_frame
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.columns import Columns
from study.experiments.hard_cases.case import HardCase

EPS = np.finfo(float).eps
# A row of S or A has about 10 entries, and each value passes through a few further operations.
OPERATIONS = 32.0
Positions = Callable[[np.ndarray], np.ndarray]
# A shape that came back to within this part of its extent is recovered.
RECOVERED = 1e-2


@dataclass(frozen=True)
class Roundoff:
    """Largest rise of the objective of one step loop by rounding alone.

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
            residual = self._residual(size)
            smallest = float(self.scene.system.inertia.min())
            return evaluation + 1.5 * float(residual @ residual) / smallest
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

    def _dense(self, columns: Columns, size: float, largest: np.ndarray) -> float:
        b = columns.B
        matrix = b.T @ (self.scene.masses[:, None] * b) / self.loop.time_step**2
        steps: Sequence[Any] = self.loop.local_steps  # those of a subspace have a matrix
        matrix = matrix + sum(step.matrix for step in steps)
        # coordinates may have different sizes, which does not change the condition: columns are
        # scaled to length one
        scale = np.sqrt(np.diag(matrix))
        eigenvalues = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        smallest, greatest = max(eigenvalues[0], EPS * eigenvalues[-1]), eigenvalues[-1]
        coordinates = float(np.linalg.norm(scale[:, None] * largest))
        error = OPERATIONS * EPS * greatest / smallest * coordinates
        residual = (np.abs(b).T @ self._residual(size)) / scale
        return float(1.5 * (residual @ residual) / smallest + 0.5 * greatest * error**2)


@dataclass(frozen=True)
class Record:
    """Course of a run, frame by frame; it ends before the first frame that is not finite.

    positions, velocities : (F + 1, N, 3) m and m/s, the start first
    rise : (F,) largest rise of the objective from one iteration to the next over the frame's first
        objective, zero if it never rose
    excess : (F,) largest rise beyond what rounding explains, J; negative or zero if none
    energy : (F + 1,) kinetic energy and that of the groups, J
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
        """Freeze the frame's data at ``q`` (N, 3) m of the reduced step and of all elements."""
        self._step.begin_frame(q)
        self._group.begin_frame(q)

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the reduced S^T W p to ``rhs`` (N, 3) at ``y`` (N, 3) m; the full energy, J."""
        self._step.accumulate(y, rhs)
        return self._group.accumulate(y, np.zeros_like(y))


def record(
    scene: Scene,
    loop: Stepper,
    state: State,
    roundoff: Roundoff,
    positions: Positions = lambda y: y,
    limit: float = np.inf,
    observe: Callable[[int, np.ndarray], None] | None = None,
) -> Record:
    """Run all frames of ``scene`` with ``loop`` from ``state``.

    Parameters
    ----------
    roundoff : what rounding explains of a rise of the objective
    positions : vertex positions (N, 3) of the coordinates of ``loop``
    limit : extent in metres at which the run ends as a blow-up
    observe : called with every frame and its last local iterate
    """
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
        rise = float(np.diff(report.objective).max(initial=0.0))
        first = float(report.objective[0])
        rises.append(rise / first if first > 0.0 else 0.0)
        excesses.append(rise - roundoff.allowance(before, after, first))
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
    rose, beyond = np.array(rises), np.array(excesses)
    return Record(q, v, rose, beyond, np.array(energies), run.blowup_frame)


def full_order(
    case: HardCase, scene: Scene, observe: Callable[[int, np.ndarray], None] | None = None
) -> Record:
    """Run ``scene``, made by ``case``, from its start; ``observe`` sees every last iterate."""
    loop = scene.stepper()
    return record(scene, loop, case.start(scene), roundoff=Roundoff(scene, loop), observe=observe)


Check = Callable[[HardCase, Scene, Record], str]


def finite(case: HardCase, scene: Scene, run: Record) -> str:
    """Every frame ran and is finite."""
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
    """Kinetic energy plus that of the groups never exceeds its start.

    From rest the first frame obeys it for every K, since its objective is this energy; later
    frames by the damping of the implicit step.
    """
    start, largest = run.energy[0], run.energy.max()
    elastic = float(np.abs(run.positions).max()) ** 2 * float(abs(scene.system.matrix).sum())
    noise = EPS * OPERATIONS * elastic
    ok = largest <= start * (1.0 + 1e-9) + noise
    return "" if ok else f"energy grows from {start:.3g} J to {largest:.3g} J"


def momentum(case: HardCase, scene: Scene, run: Record) -> str:
    """Linear momentum changes by nothing but gravity."""
    h, masses = scene.config.time_step, scene.masses
    pull = sum((f.acceleration(run.positions[0], run.velocities[0]) for f in scene.forces), 0.0)
    frames = np.arange(len(run.velocities))[:, None]
    found = np.einsum("n,fna->fa", masses, run.velocities)
    expected = found[0] + frames * h * masses.sum() * np.broadcast_to(pull, 3)
    error = np.abs(found - expected).max()
    # the columns of S^T W p and of the solve's residual sum to zero up to rounding only
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
    """List what does not hold in the full-order run of ``case``, empty if all does.

    Of one that must be refused, building the scene or its first frames must raise a named error.
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
