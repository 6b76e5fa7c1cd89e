"""The sensitivity floor behind a figure."""

import pandas as pd

from pdrom.core.store import read_table
from pdrom.model.runs.horizon import floor_of, horizon
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

COLUMNS = ["scene", "perturbation", "frame", "relative_difference"]


def read_sensitivity(sources: Sources) -> pd.DataFrame:
    """Table of perturbed runs; StorageError if it is missing or lacks a column."""
    return read_table(sources.table("sensitivity"), COLUMNS)


def instant(sources: Sources, spec: FigureSpec, scene: str, frame: int) -> str:
    """Label of a frame; one past the scene's horizon says so: there no run can be judged."""
    floor = floor_of(read_sensitivity(sources), scene, spec.perturbation)
    past = len(floor) > 0 and frame > horizon(floor, spec.threshold)
    return f"frame {frame}, past horizon" if past else f"frame {frame}"
