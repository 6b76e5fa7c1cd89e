"""Classes of the runs that `pdrom.api.run` and `pdrom.api.reduce` return."""

from dataclasses import dataclass

import h5py
import numpy as np

from pdrom.core.packed import brief
from pdrom.model.scene import Scene
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.rerun import Rerun, mean_motion


@dataclass(frozen=True, eq=False)
class Snapshots:
    """n training snapshots of a group: projections p (n, rows, 3), norms of round-off in p (n,)."""

    p: np.ndarray
    roundoff: np.ndarray

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class FullRun:
    """A full-order run.

    positions : (F + 1, N, 3) m; entry 0 is the initial state
    ms : (F,) milliseconds of each frame
    snapshots : name of each constraint group -> its training snapshots
    """

    scene: Scene
    positions: np.ndarray
    ms: np.ndarray
    snapshots: dict[str, Snapshots]

    def __repr__(self) -> str:
        held = f"snapshots of {', '.join(self.snapshots)}" if self.snapshots else "no snapshots"
        return f"FullRun({self.scene!r}, {np.median(self.ms):.3g} ms a frame, {held})"


@dataclass(frozen=True, eq=False)
class ReducedRun:
    """A run with the projections of one group reduced, compared with its full-order run.

    gain : factor by which sampling can amplify errors; 1 if every projection is evaluated
    outcome : positions (F' + 1, N, 3) m of F' frames, differences from the full order, any blow-up
    ms : median milliseconds per frame
    """

    full: FullRun
    group: str
    method: str
    r: int
    gain: float
    outcome: Rerun
    ms: float

    def __repr__(self) -> str:
        name, outcome = self.full.scene.config.name, self.outcome
        ended = f"error {self.error[-1]:.3g} at the end" if outcome.frames else "no frame"
        ended = ended if outcome.finite else f"blew up at frame {outcome.blowup_frame}"
        return f"ReducedRun('{name}': {self.title}, gain {self.gain:.3g}, {ended})"

    @property
    def error(self) -> np.ndarray:
        """Error of each frame (F',), relative to the RMS displacement of the full-order run."""
        return self.outcome.difference / mean_motion(self.full.positions)

    @property
    def errors(self) -> dict[str, float | None]:
        """Errors of the whole run: positions, velocities, shape, energy, first contact.

        Keys are column names of the table reduced_reruns. A value is None if the run ended early,
        or if the full-order run lacks the quantity, such as a first contact.
        """
        return Yardstick(self.full.scene, self.full.positions).errors(self.outcome)

    @property
    def title(self) -> str:
        """Text with the group, the method and the size r of the reduction."""
        return f"{self.group.replace('_', ' ')}, {self.method}, r = {self.r}"


AnyRun = FullRun | ReducedRun


def full_run(scene: Scene, file: h5py.File) -> FullRun:
    """Full-order run of ``scene`` from the open HDF5 ``file``."""
    stored = file.get("snapshots", {})
    return FullRun(
        scene,
        file["positions"][...],
        file["timings"][...].sum(axis=1),
        {name: Snapshots(s["p"][...], s["roundoff"][...]) for name, s in stored.items()},
    )
