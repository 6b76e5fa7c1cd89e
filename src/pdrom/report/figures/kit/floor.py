"""Sensitivity floors and horizons of the scenes, as the table sensitivity has them."""

import numpy as np

from pdrom.model.runs.horizon import floor_of, horizons
from pdrom.report.figures.kit.results import Results

COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


class Floors:
    """Floor and horizon of every scene at the study's reference perturbation.

    Raises
    ------
    StorageError
        The table is missing or lacks a column.
    """

    def __init__(self, results: Results) -> None:
        self.perturbation = results.settings["sensitivity.reference"]
        self.threshold = results.settings["sensitivity.threshold"]
        self._table = results.table("sensitivity", COLUMNS)
        self._horizons = horizons(self._table, self.perturbation, self.threshold)

    def of(self, scene: str) -> np.ndarray:
        """Largest relative difference of all seeds by frame (F,); empty without perturbed runs."""
        return floor_of(self._table, scene, self.perturbation)

    def horizon(self, scene: str) -> int | None:
        """First frame at which the floor exceeds the threshold; None if it never does."""
        end = self._horizons.get(scene, 0)
        return end if end < len(self.of(scene)) else None

    def instant(self, scene: str, frame: int) -> str:
        """Label of a frame; one past the scene's horizon says so: there no run can be judged."""
        end = self.horizon(scene)
        return f"frame {frame}" if end is None or frame <= end else f"frame {frame}, past horizon"
