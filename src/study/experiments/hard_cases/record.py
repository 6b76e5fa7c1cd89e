"""Hard cases (scenes with extreme input): initial states, and runs with bounds of rounding errors.

In exact arithmetic, the objective 1/(2h^2) |M^1/2 (y - s)|^2 + sum_j W_j(y) falls in every
iteration (y: positions, s: prediction, h: time step, M: masses, W_j: energy of group j). Computed
values may rise for two reasons, with the unit round-off u (`EPS`) and a constant c (`OPERATIONS`):

- evaluation: y - s and S y - p have errors up to c u (|y| + |s|) and c u (|S| |y| + |p|), where p
  are the projections of S y. If R is the objective of these errors alone, the error of a value E is
  at most 2 sqrt(E R) + R (Cauchy-Schwarz);
- solution: the global step minimises a quadratic with matrix A. An error d of y misses the minimum
  by d^T A d / 2. A Cholesky solve leaves a residual |r| <= c u |A| |y| (Higham 2002, theorem 10.4),
  so that the minimum is missed by at most |r|^2 / (2 lambda_min(A)). In a subspace with columns B
  and coordinates z, B^T maps this error to the reduced right-hand side, so that
  r <= c u |B|^T |A| |y|, and the explicit inverse adds d <= c u cond(A) |z|, where A has columns
  scaled to length one.

Without pins, the smallest mass divided by h^2 is a lower bound of lambda_min, a very loose one if
masses are round-off compared with the weights of the groups, so that only pins make A regular.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdrom.core.yamlfile import validate
from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.model.mesh.types import Mesh
from pdrom.model.runs import BoundedRun
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.subspace.model import SubspaceModel

Start = Callable[[Scene], State]
Shape = Callable[[], Mesh]
SEED = 7


@dataclass(frozen=True)
class HardCase:
    """A scene that is hard for a reason (``why``), and the properties that its run must have.

    holds : names of the properties that the full-order run must have (tests/physics); if it is
        "refused" only, an error must be raised when the scene is built or run
    mesh, effects, settings : arguments of `build`; ``mesh`` is a function that returns the mesh
    start : function of the scene that returns the state before the first frame
    bound : largest allowed extent (longest side of the bounding box) of the run, relative to the
        largest one of start, rest shape and fixed vertices
    slow : whether only the slow tests run this scene
    """

    name: str
    why: str
    holds: tuple[str, ...]
    mesh: Shape
    effects: tuple[dict[str, Any], ...]
    settings: dict[str, Any]
    start: Start = Scene.initial_state
    bound: float = 2.0
    slow: bool = False

    def scene(self) -> Scene:
        """Build the scene; raise PdromError if it is refused."""
        return build(self.mesh(), *self.effects, **self.settings)


def build(
    mesh: Mesh,
    *effects: dict[str, Any],
    frames: int = 30,
    masses: Callable[[Mesh], np.ndarray] | None = None,
    **settings: Any,
) -> Scene:
    """Build a scene of ``effects`` on ``mesh``.

    ``masses`` is a function of the mesh that returns masses (N,) in kg; without it, masses are
    equal. ``settings`` are keys of `SceneConfig`.
    """
    named = {"name": "hard_case", "title": "hard case"}
    own = {"mesh": {"kind": "file", "path": "generated"}, "frames": frames, **settings}
    config = validate(SceneConfig, {**named, **own, "effects": list(effects)}, "hard case")
    return Scene.build(config, mesh, masses=None if masses is None else masses(mesh))


def at_rest(positions: np.ndarray) -> State:
    """Return a state with ``positions`` (N, 3) m and without velocities."""
    return State(positions, np.zeros_like(positions))


def mapped(*rows: tuple[float, float, float]) -> Start:
    """Start at rest, in the rest shape mapped about its centre by a matrix with these ``rows``."""

    def start(scene: Scene) -> State:
        points = scene.mesh.points
        centre = points.mean(axis=0)
        return at_rest(centre + (points - centre) @ np.array(rows).T)

    return start


def scales(x: float, y: float, z: float) -> Start:
    """Start at rest, in the rest shape scaled about its centre; a negative factor mirrors it."""
    return mapped((x, 0, 0), (0, y, 0), (0, 0, z))


def scrambled(size: float = 1.0) -> Start:
    """Start at rest, vertices at random in a cube of ``size`` times the mesh's longest side."""

    def start(scene: Scene) -> State:
        points = scene.mesh.points
        box = np.random.default_rng(SEED).uniform(-0.5, 0.5, points.shape)
        return at_rest(points.mean(axis=0) + size * scene.mesh.extent * box)

    return start


def noisy(start: Start, size: float) -> Start:
    """Start at rest, in the positions of ``start`` with added normally distributed noise.

    Its standard deviation is ``size`` times the longest side of the mesh's bounding box.
    """

    def moved(scene: Scene) -> State:
        noise = np.random.default_rng(SEED).standard_normal(scene.mesh.points.shape)
        return at_rest(start(scene).positions + size * scene.mesh.extent * noise)

    return moved


def pairs_merged(scene: Scene) -> State:
    """Start with every odd vertex on the vertex before it: edges between the two have no length."""
    points = scene.mesh.points.copy()
    points[1::2] = points[: len(points) - len(points) % 2 : 2]
    return at_rest(points)


def folded(scene: Scene) -> State:
    """Start folded: the half with larger x is mirrored onto the half with smaller x."""
    points = scene.mesh.points.copy()
    centre = 0.5 * (points[:, 0].min() + points[:, 0].max())
    points[:, 0] = centre - np.abs(points[:, 0] - centre)
    return at_rest(points)


def falling(speed: float) -> Start:
    """Start in the rest shape, with all vertices moving down at ``speed`` (m/s)."""
    return lambda scene: _vertical(scene, np.full(len(scene.mesh.points), -speed))


def meeting(speed: float) -> Start:
    """Start with vertices above the mean height moving down, the rest up, at ``speed`` (m/s)."""

    def start(scene: Scene) -> State:
        y = scene.mesh.points[:, 1]
        return _vertical(scene, np.where(y > y.mean(), -speed, speed))

    return start


def _vertical(scene: Scene, speeds: np.ndarray) -> State:
    points = scene.mesh.points.copy()
    velocities = np.zeros_like(points)
    velocities[:, 1] = speeds
    return State(points, velocities)


def lowered(offset: float) -> Start:
    """Start at rest, in the rest shape moved by ``offset`` (m) along y."""
    return lambda scene: at_rest(scene.mesh.points + np.array([0.0, offset, 0.0]))


EPS = np.finfo(float).eps
# Constant c (see top): a few roundings for each of some 10 entries in a row of matrix S or A.
OPERATIONS = 32.0


@dataclass(frozen=True)
class Roundoff:
    """Bound for the rise of a frame's objective in one iteration by rounding errors alone.

    basis : (N, K) columns B if positions are B z with coordinates z, else None
    """

    scene: Scene
    loop: Stepper
    basis: np.ndarray | None = None

    def allowance(self, before: State, after: State, first: float) -> float:
        """Bound (J) for the rise of the objective by rounding errors in any iteration of a frame.

        ``first`` is the objective (J) at the beginning of the frame. The largest coordinate of the
        iterates is estimated from the states ``before`` and ``after`` the frame.
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
        """Objective R of rounding errors alone, J (see module), if all |y| are <= ``size`` m."""
        h = self.loop.time_step
        unit = OPERATIONS * EPS * size
        total = 1.5 * float(self.scene.masses.sum()) / h**2 * (2.0 * unit) ** 2
        for group in self.scene.groups:
            rows = np.asarray(abs(group.S).sum(axis=1)).ravel()
            total += 1.5 * float(group.row_weights @ (2.0 * rows * unit) ** 2)
        return total

    def _residual(self, size: float) -> np.ndarray:
        """Bound (N,) of a global solve's residual |r| (see the module) for all |y| = ``size`` m."""
        rows = np.asarray(abs(self.scene.system.matrix).sum(axis=1)).ravel()
        return OPERATIONS * EPS * size * rows

    def _dense(self, b: np.ndarray, size: float, largest: np.ndarray) -> float:
        matrix = b.T @ (self.scene.masses[:, None] * b) / self.loop.time_step**2
        steps: Sequence[Any] = self.loop.local_steps  # each has ``matrix``, its reduced stiffness
        matrix = matrix + sum(step.matrix for step in steps)
        # with a unit diagonal of A the bound does not depend on the units of the coordinates z
        scale = np.sqrt(np.diag(matrix))
        eigenvalues = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        smallest, greatest = max(eigenvalues[0], EPS * eigenvalues[-1]), eigenvalues[-1]
        coordinates = float(np.linalg.norm(scale[:, None] * largest))
        error = OPERATIONS * EPS * greatest / smallest * coordinates
        residual = (np.abs(b).T @ self._residual(size)) / scale
        return float(1.5 * (residual @ residual) / smallest + 0.5 * greatest * error**2)


@dataclass(frozen=True)
class Record:
    """A run; it ends with a frame whose bounding box is too large, or before a non-finite frame.

    positions, velocities : (F + 1, N, 3) m and m/s, beginning with the start
    excess : (F,) largest rise of the objective from one iteration to the next, J, minus the bound
        for rounding errors; empty if the objective was not tracked
    blowup_frame : number of this too large or non-finite frame, None if there is none
    """

    positions: np.ndarray
    velocities: np.ndarray
    excess: np.ndarray
    blowup_frame: int | None

    @property
    def extent(self) -> float:
        """Largest side of the bounding box in any frame, m."""
        return float(np.ptp(self.positions, axis=1).max())


def record(
    scene: Scene,
    loop: Stepper,
    state: State,
    model: SubspaceModel | None = None,
    limit: float = np.inf,
) -> Record:
    """Run all frames of ``scene`` with ``loop`` from ``state``.

    model : model in whose position subspace ``loop`` runs; None if it runs without a subspace
    limit : longest side of the bounding box, in m, above which the run ends as a blow-up
    """
    roundoff = Roundoff(scene, loop, None if model is None else model.columns.B)
    positions: Callable[[np.ndarray], np.ndarray] = model.positions if model else lambda y: y
    states, excesses = [(positions(state.positions), positions(state.velocities))], list[float]()

    def frames(state: State, numbers: range) -> Iterator[tuple[State, FrameReport]]:
        for number in numbers:
            state, report = loop.step(state, number)
            yield state, report

    run = BoundedRun(frames, state, scene.config.frames, limit, positions=positions)
    for frame in run:
        before, after, values = state, frame.state, frame.report.objective
        with np.errstate(over="ignore", invalid="ignore"):
            v = positions(after.velocities)
        if not np.isfinite(v).all():
            run.blowup_frame = frame.number
            break
        if len(values):
            allowed = roundoff.allowance(before, after, float(values[0]))
            excesses.append(float(np.diff(values).max(initial=0.0)) - allowed)
        states.append((frame.positions, v))
        state = after
    q, v = (np.stack(parts) for parts in zip(*states, strict=True))
    return Record(q, v, np.array(excesses), run.blowup_frame)


def reach(scene: Scene, positions: np.ndarray) -> float:
    """Longest side (m) of the boxes of rest shape, start and fixed vertices in (F + 1, N, 3) m."""
    sizes = [scene.mesh.extent, float(np.ptp(positions[0], axis=0).max())]
    held = np.unique(np.concatenate([[], *(b.vertices for b in scene.boundaries)]).astype(int))
    if len(held):
        sizes.append(float(np.ptp(positions[:, held], axis=1).max()))
    return max(sizes)


def keeps_momentum(scene: Scene, run: Record) -> bool:
    """Whether gravity alone changes the linear momentum in the ``run`` of ``scene``."""
    h, masses = scene.config.time_step, scene.masses
    pull = sum((f.acceleration(run.positions[0], run.velocities[0]) for f in scene.forces), 0.0)
    frames = np.arange(len(run.velocities))[:, None]
    found = np.einsum("n,fna->fa", masses, run.velocities)
    expected = found[0] + frames * h * masses.sum() * np.broadcast_to(pull, 3)
    error = np.abs(found - expected).max()
    # allowed error of momentum: round-off of S^T W p summed over vertices, residual of the solver
    size = float(np.abs(run.positions).max()) + float(np.abs(run.velocities).max()) * h
    noise = EPS * OPERATIONS * size * (masses.sum() / h + h * abs(scene.system.matrix).sum())
    return bool(error <= noise * max(1.0, np.sqrt(len(found))))
