"""The sensitivity floor of a scene, from the table of perturbed runs."""

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


def read_sensitivity(sources: Sources) -> pd.DataFrame:
    """Table of perturbed runs; StorageError if it is missing or lacks a column."""
    return read_table(sources.table("sensitivity"), COLUMNS)


def floor_of(table: pd.DataFrame, scene: str, perturbation: float) -> pd.Series:
    """Largest relative difference of all seeds by frame; empty if the scene was not perturbed.

    Labels of ``perturbation`` that are no numbers (another solver, another time step) do not count.
    """
    size = pd.to_numeric(table.perturbation, errors="coerce").to_numpy(float)
    rows = table[(table.scene == scene) & np.isclose(size, perturbation, rtol=1e-6, atol=0.0)]
    return rows.groupby("frame").relative_difference.max().sort_index()


def horizon(floor: pd.Series, threshold: float) -> int | None:
    """First frame at which the floor exceeds ``threshold``; None if it never does."""
    above = floor[~(floor <= threshold)]
    return int(above.index[0]) if len(above) else None


def instant(sources: Sources, spec: FigureSpec, scene: str, frame: int) -> str:
    """Label of a frame; one past the scene's horizon says so: there no run can be judged."""
    end = horizon(floor_of(read_sensitivity(sources), scene, spec.perturbation), spec.threshold)
    return f"frame {frame}" if end is None or frame <= end else f"frame {frame}, past horizon"
