"""A scene with its runs, as the page and pictures show it."""

from dataclasses import dataclass, field

import numpy as np

from pdrom.model.effects.base import EffectConfig
from pdrom.model.mesh.types import Mesh


@dataclass(frozen=True)
class ViewedRun:
    """A reduced run.

    group, method, title : names of what is reduced and how, and the method in words
    positions : (F' + 1, N, 3) m, finite, the initial ones first; it may have ended early
    error : (F',) relative error of each frame
    blowup_frame : None for a run that reached its end
    ms : milliseconds a frame, None where nobody measured
    """

    group: str
    method: str
    title: str
    r: int
    positions: np.ndarray
    error: np.ndarray
    blowup_frame: int | None
    ms: float | None


@dataclass(frozen=True)
class ViewedScene:
    """A scene with its full-order run and the reduced ones.

    time_step : of a frame, s
    positions : (F + 1, N, 3) m of the full order
    ms : milliseconds a frame of the full order, None where nobody measured
    floor : (F,) sensitivity floor, empty where it is not known
    horizon : frame from which on no run can be judged, None if there is none or it is not known
    runs : reduced runs, by group, method and ascending size
    effects : those of the scene; what has a body is shown
    velocities : (F + 1, N, 3) m/s of the full order, None where they were not stored
    first : kind of the run that the others are compared with
    """

    name: str
    title: str
    mesh: Mesh
    time_step: float
    positions: np.ndarray
    ms: float | None
    floor: np.ndarray = field(default_factory=lambda: np.empty(0))
    horizon: int | None = None
    runs: tuple[ViewedRun, ...] = ()
    effects: tuple[EffectConfig, ...] = ()
    velocities: np.ndarray | None = None
    first: str = "full order"

    @property
    def groups(self) -> list[str]:
        """Groups that are reduced."""
        return list(dict.fromkeys(run.group for run in self.runs))

    def sizes(self, group: str, method: str) -> list[ViewedRun]:
        """Runs of a group and a method by ascending size."""
        return [run for run in self.runs if (run.group, run.method) == (group, method)]
