"""A scene with its runs, as pictures, films and the viewer's page show it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd

from pdrom.model.effects.base import EffectConfig
from pdrom.model.mesh.types import Mesh


@dataclass(frozen=True)
class ViewedRun:
    """A reduced run.

    group, method, title : names of what is reduced and how, and the method in words
    read : reads the positions
    error : (F',) relative error of each frame
    blowup_frame : None for a run that lived
    ms : milliseconds a frame, None where nobody measured
    on_page : whether it is one of the sizes that the viewer offers
    """

    group: str
    method: str
    title: str
    r: int
    read: Callable[[], np.ndarray]
    error: np.ndarray
    blowup_frame: int | None
    ms: float | None
    on_page: bool = True

    @cached_property
    def positions(self) -> np.ndarray:
        """Positions (F' + 1, N, 3) m, finite, the initial ones first; it may have ended early."""
        return self.read()


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
    tables : makes the tables that are known of the scene, by their names
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
    tables: Mapping[str, Callable[[], pd.DataFrame]] = field(default_factory=dict)

    @property
    def groups(self) -> list[str]:
        """Groups that are reduced."""
        return list(dict.fromkeys(run.group for run in self.runs))

    def sizes(self, group: str, method: str) -> list[ViewedRun]:
        """Runs of a group and a method by ascending size."""
        return [run for run in self.runs if (run.group, run.method) == (group, method)]
