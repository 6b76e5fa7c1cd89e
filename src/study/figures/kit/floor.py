"""Sensitivity floors and horizons of the scenes that a figure draws."""

from collections.abc import Sequence

import numpy as np

from pdrom.core.store import read_table
from study.artifact.paths import SENSITIVITY, File
from study.artifact.reads import EachOf, Read, Setting
from study.experiments.kit.horizon import floor_of, horizon
from study.experiments.kit.settings import Horizon

# What a figure with sensitivity floors reads.
FLOORS: dict[str, Read] = {
    "sensitivity": EachOf(SENSITIVITY, "experiments"),
    "horizon": Setting("horizon"),
}
COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


class Floors:
    """Floor and horizon of a scene at the study's reference perturbation.

    Parameters
    ----------
    sensitivity : table of the perturbed runs of each scene

    Raises
    ------
    StorageError
        The file of a scene that is asked for is damaged or lacks a column.
    """

    def __init__(self, sensitivity: Sequence[File], horizon: Horizon) -> None:
        self.perturbation, self.threshold = horizon.perturbation, horizon.threshold
        self._paths = {file["scene"]: file.path for file in sensitivity}
        self._floors: dict[str, np.ndarray] = {}

    def of(self, scene: str) -> np.ndarray:
        """Largest relative difference of all seeds of ``scene`` by frame (F,).

        It is empty without perturbed runs.
        """
        if scene not in self._floors:
            table = read_table(self._paths[scene], COLUMNS)
            self._floors[scene] = floor_of(table, scene, self.perturbation)
        return self._floors[scene]

    def horizon(self, scene: str) -> int | None:
        """First frame at which the floor of ``scene`` exceeds the threshold; None if none does."""
        floor = self.of(scene)
        end = horizon(floor, self.threshold)
        return end if end < len(floor) else None

    def instant(self, scene: str, frame: int) -> str:
        """Label of a frame; one past the scene's horizon says so: there no run can be judged."""
        end = self.horizon(scene)
        return f"frame {frame}" if end is None or frame <= end else f"frame {frame}, past horizon"
