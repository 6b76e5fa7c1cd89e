"""Runs of a scene in memory, for what shows every frame of them."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.paths import FULL_ORDER, RERUNS
from pdrom.core.store import open_hdf5
from pdrom.report.figures.kit.read import RerunInfo, rerun_infos
from pdrom.report.scenes.results import SceneResults
from pdrom.report.scenes.sizes import shown


@dataclass(frozen=True)
class LoadedRun:
    """A reduced run.

    positions : (F' + 1, N, 3) m, finite, the initial ones first; it may have ended early
    error : (F',) relative error of each frame
    """

    group: str
    method: str
    info: RerunInfo
    positions: np.ndarray
    error: np.ndarray

    @property
    def name(self) -> str:
        """Group, method and size."""
        return f"{self.group} {self.method} r={self.info.r}"


def full_order(results: SceneResults) -> np.ndarray:
    """Positions (F + 1, N, 3) m of the full-order run."""
    with open_hdf5(results.path(FULL_ORDER, results.scene)) as file:
        return file["positions"][...]


def reduced(results: SceneResults) -> list[LoadedRun]:
    """One run of each group and method, of the size that pictures show; without those not run."""
    found = []
    for group, method in results.reductions:
        path = results.path(RERUNS, results.scene, group, method)
        info = shown(rerun_infos(path))
        if info is not None and info.entries:
            found.append(load_run(path, group, method, info))
    return found


def load_run(path: str, group: str, method: str, info: RerunInfo) -> LoadedRun:
    """One size of a file of reduced runs, up to its last finite frame."""
    with open_hdf5(path) as file:
        positions, error = (file[info.label][name][...] for name in ("positions", "error"))
    finite = np.isfinite(positions).all(axis=(1, 2))
    end = len(finite) if finite.all() else int(np.argmin(finite))
    return LoadedRun(group, method, info, positions[:end], error[: max(end - 1, 0)])
