"""Table sensitivity, and the floor and horizon that it defines (EXPERIMENTS section 5)."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.model.runs.sensitivity import horizon
from pdrom.tables.columns import conform


def sensitivity(paths: Iterable[str]) -> pd.DataFrame:
    """Largest difference over the seeds, per scene, perturbation and frame."""
    every = pd.concat([read_table(path) for path in paths], ignore_index=True)
    keys = ["scene", "perturbation", "frame"]
    table = every.groupby(keys, sort=False, as_index=False)["relative_difference"].max()
    return conform(table, "sensitivity")


def floor_of(table: pd.DataFrame, scene: str, perturbation: float | str) -> np.ndarray:
    """Sensitivity floor (F,) of a scene at one size (or under one label) of the perturbation."""
    label = perturbation if isinstance(perturbation, str) else f"{perturbation:g}"
    rows = table[(table.scene == scene) & (table.perturbation == label)]
    return rows.sort_values("frame").relative_difference.to_numpy()


def horizons(table: pd.DataFrame, perturbation: float | str, threshold: float) -> dict[str, int]:
    """First frame of each scene at which the floor exceeds ``threshold`` (else the frame count)."""
    scenes = table.scene.unique()
    return {s: horizon(floor_of(table, s, perturbation), threshold) for s in scenes}
