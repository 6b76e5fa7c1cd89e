"""Sensitivity floors and horizons of the scenes that a figure draws."""

import numpy as np

from pdrom.core.store import read_table
from study.artifact.paths import SENSITIVITY
from study.artifact.reads import Chosen, Setting
from study.experiments.kit.horizon import floor_of, horizon
from study.figures.kit.results import Results

# What a figure with sensitivity floors reads.
FLOORS = (
    Chosen(SENSITIVITY), Setting("sensitivity.reference"), Setting("sensitivity.threshold"),
)  # fmt: skip
COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


class Floors:
    """Floor and horizon of a scene at the study's reference perturbation.

    Raises
    ------
    StorageError
        The file of a scene that is asked for is missing or lacks a column.
    """

    def __init__(self, results: Results) -> None:
        self.perturbation = results.settings["sensitivity.reference"]
        self.threshold = results.settings["sensitivity.threshold"]
        self._results = results
        self._floors: dict[str, np.ndarray] = {}

    def of(self, scene: str) -> np.ndarray:
        """Largest relative difference of all seeds of ``scene`` by frame (F,).

        It is empty without perturbed runs.
        """
        if scene not in self._floors:
            table = read_table(self._results.path(SENSITIVITY, scene), COLUMNS)
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
