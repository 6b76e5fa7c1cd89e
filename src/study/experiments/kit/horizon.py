"""Up to which frame a run can be judged: sensitivity floor, horizon, error within the horizon.

The floor of a scene is how far its full-order run drifts when the start is moved a little, by frame
and over all seeds (`study.experiments.kit.sensitivity`). From the horizon on the floor exceeds a
threshold, and a difference between two runs says nothing about their methods.
"""

import numpy as np
import pandas as pd


def floor_of(table: pd.DataFrame, scene: str, perturbation: float | str) -> np.ndarray:
    """Sensitivity floor (F,) of a scene at one size (or under one label) of the perturbation.

    Empty if the scene was not perturbed in this way.

    Parameters
    ----------
    table : perturbed runs with scene, perturbation, frame and relative_difference; seeds may be
        rows of their own or joined
    """
    label = perturbation if isinstance(perturbation, str) else f"{perturbation:g}"
    # a column without words is read from a file as numbers
    rows = table[(table.scene == scene) & (table.perturbation.astype(str) == label)]
    return rows.groupby("frame").relative_difference.max().to_numpy(float)


def horizon(floor: np.ndarray, threshold: float) -> int:
    """First frame at which the floor (F,) exceeds ``threshold``; F if it never does."""
    above = np.flatnonzero(~(floor <= threshold))
    return int(above[0]) if len(above) else len(floor)


def horizons(table: pd.DataFrame, perturbation: float | str, threshold: float) -> dict[str, int]:
    """`horizon` of every scene of the table by ``threshold``, see `floor_of` (``perturbation``)."""
    scenes = table.scene.unique()
    return {s: horizon(floor_of(table, s, perturbation), threshold) for s in scenes}
