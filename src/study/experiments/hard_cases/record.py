"""One run of a hard case, watched from the outside."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pdrom.model.dynamics.stepper import FrameReport, LocalStep, State, Stepper
from pdrom.model.runs.bounded import BoundedRun, frame_by_frame
from pdrom.model.scene import Scene
from study.experiments.hard_cases.roundoff import Roundoff

Positions = Callable[[np.ndarray], np.ndarray]


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
    q, v = (np.stack(parts) for parts in zip(*states, strict=True))
    return Record(
        q, v, np.array(rises), np.array(excesses), _energies(scene, q, v), run.blowup_frame
    )


def _energies(scene: Scene, positions: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Kinetic energy plus that of the groups in each state, (F + 1,)."""
    energies = []
    with np.errstate(over="ignore", invalid="ignore"):
        for q, v in zip(positions, velocities, strict=True):
            kinetic = 0.5 * float(scene.masses @ (v**2).sum(axis=1))
            for group in scene.groups:
                group.begin_frame(q)
            groups = sum(group.accumulate(q, np.zeros_like(q)) for group in scene.groups)
            energies.append(kinetic + groups)
    return np.array(energies)
