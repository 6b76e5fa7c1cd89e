"""Records that `run` and `reduce` return."""

from dataclasses import dataclass, field

import h5py
import numpy as np

from pdrom.core.brief import brief
from pdrom.model.scene import Scene
from pdrom.reduction.asked.ask import Ask
from pdrom.reduction.asked.run import Asked
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.local.guard import GuardRecord
from pdrom.reduction.rerun import Rerun, mean_motion


@dataclass(frozen=True)
class Snapshots:
    """Projections p (n, e p, 3) of a group at the training frames, and their round-off (n,)."""

    p: np.ndarray
    roundoff: np.ndarray

    __repr__ = brief


@dataclass(frozen=True)
class FullRun:
    """A full-order run.

    positions : (F + 1, N, 3) m, the initial ones first
    ms : (F,) milliseconds of each frame
    snapshots : of every constraint group, for a basis
    """

    scene: Scene
    positions: np.ndarray
    ms: np.ndarray
    snapshots: dict[str, Snapshots]

    def __repr__(self) -> str:
        held = f"snapshots of {', '.join(self.snapshots)}" if self.snapshots else "no snapshots"
        return f"FullRun({self.scene!r}, {np.median(self.ms):.3g} ms a frame, {held})"


@dataclass(frozen=True)
class ReducedRun:
    """A run with the projections of one group reduced, compared with its full-order run.

    gain : norm of the sampled equations' solution operator; 1 if every projection is evaluated
    outcome : positions (F' + 1, N, 3) m, differences, and whether it blew up
    ms : milliseconds a frame (median), those of a guard included
    seen : what the guard saw, if there was one
    """

    full: FullRun
    group: str
    method: str
    r: int
    gain: float
    outcome: Rerun
    ms: float
    seen: GuardRecord = field(default_factory=GuardRecord.unwatched)

    def __repr__(self) -> str:
        name, outcome = self.full.scene.config.name, self.outcome
        ended = f"error {self.error[-1]:.3g} at the end" if outcome.frames else "no frame"
        ended = ended if outcome.finite else f"blew up at frame {outcome.blowup_frame}"
        return f"ReducedRun('{name}': {self.title}, gain {self.gain:.3g}, {ended})"

    @property
    def error(self) -> np.ndarray:
        """Error of each frame (F',) relative to the root mean square displacement of the run."""
        return self.outcome.difference / mean_motion(self.full.positions)

    @property
    def errors(self) -> dict[str, float | None]:
        """Errors of the whole run: positions, velocities, shape, energy, first contact.

        By the names of the table reduced_reruns; None if the run ended early, or where the
        full-order run has nothing to compare with.
        """
        return Yardstick(self.full.scene, self.full.positions).errors(self.outcome)

    @property
    def title(self) -> str:
        """Group, method and size of the reduction."""
        return f"{self.group.replace('_', ' ')}, {self.method}, r = {self.r}"


@dataclass(frozen=True)
class AskedRun:
    """A run that keeps to an asked error.

    scene : its motion
    ask : the wish
    outcome : positions (F + 1, N, 3) m, what was done, and what it is estimated to have reached
    ms : (F,) milliseconds a frame, checks and repairs shared out evenly
    offline_s : seconds that the choice took before the run
    horizon : frames of the own motions that an error can be known for; the promise ends there
    error : true error against the converged implicit step, on the motion that the choice was made
        on; None on another one, where it is not known
    """

    scene: Scene
    ask: Ask
    outcome: Asked
    ms: np.ndarray
    offline_s: float
    horizon: int
    error: float | None

    def __repr__(self) -> str:
        kept = "kept" if self.outcome.promised else "not promised"
        steps = ", ".join(f"from {frame} {title}" for frame, title in self.outcome.changes)
        return f"AskedRun('{self.scene.config.name}': {self.ask} {kept}; {steps})"


def full_run(scene: Scene, file: h5py.File) -> FullRun:
    """Full-order run of ``scene`` from the open HDF5 ``file``."""
    stored = file.get("snapshots", {})
    return FullRun(
        scene,
        file["positions"][...],
        file["timings"][...].sum(axis=1),
        {name: Snapshots(s["p"][...], s["roundoff"][...]) for name, s in stored.items()},
    )
