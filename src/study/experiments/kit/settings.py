"""Settings that several experiments share, and up to which frame a run can be judged.

The floor of a scene is how far its full-order run drifts when the start is moved a little, by frame
and over all seeds (`study.experiments.sensitivity`). From the horizon on the floor exceeds a
threshold, and a difference between two runs says nothing about their methods.
"""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from pydantic import AfterValidator, Field

from pdrom.core.store import read_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.solvers import SOLVERS
from study.artifact.paths import File

FOM = "fom"  # the full-order run with its own or another number of iterations
ANDERSON = "fom-anderson"  # the same with accelerated iterations

# phases of a frame other than effects
RIGHT, GLOBAL, REST = "right-hand side", "global solve", "rest of the frame"
# a run ends when its bounding box exceeds this multiple of the rest extent
BlowupExtent = Annotated[float, Field(gt=1.0, le=1e12)]
Count = Annotated[int, Field(ge=1, le=100_000)]
Repeats = Annotated[int, Field(ge=1, le=1000)]
Modes = Annotated[int, Field(ge=1, le=1000)]
Tolerance = Annotated[float, Field(gt=0.0, lt=1.0)]
# factors on the vertices along a side, for scenes by name
Sizes = dict[str, tuple[Annotated[float, Field(gt=0.0, le=100.0)], ...]]
PositionBasis = Literal["pod", "skinning"]
Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]


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


def _known(solver: str) -> str:
    if solver not in SOLVERS:
        raise ValueError(f"allowed are {', '.join(SOLVERS)}")
    return solver


Solver = Annotated[str, AfterValidator(_known)]


class Horizon(ConfigModel):
    """Up to which frame a run is judged: the spread of the runs perturbed by ``perturbation``.

    The horizon is the first frame at which the spread exceeds ``threshold``.
    """

    perturbation: Tolerance
    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

    def frames(self, perturbed: File) -> int:
        """Frames before the horizon of a scene, from the table of its perturbed runs."""
        spread = floor_of(read_table(perturbed.path), perturbed["scene"], self.perturbation)
        return horizon(spread, self.threshold)


def resolve_ranks(ranks: Sequence[Rank], rank: int) -> list[int]:
    """``ranks`` ascending, "full" replaced by the numerical ``rank`` (left out if 0)."""
    full = [rank] if "full" in ranks and rank > 0 else []
    return sorted({*(int(r) for r in ranks if r != "full"), *full})
