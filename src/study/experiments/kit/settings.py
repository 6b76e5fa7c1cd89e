"""Kinds of values that the settings of several experiments share."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from pdrom.core.store import read_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.model.dynamics.solvers import SOLVERS
from study.artifact.paths import File
from study.experiments.kit.horizon import floor_of, horizon


def _known(solver: str) -> str:
    if solver not in SOLVERS:
        raise ValueError(f"allowed are {', '.join(SOLVERS)}")
    return solver


Solver = Annotated[str, AfterValidator(_known)]
# a run ends when its bounding box exceeds this multiple of the rest extent
BlowupExtent = Annotated[float, Field(gt=1.0, le=1e12)]
Count = Annotated[int, Field(ge=1, le=100_000)]
Repeats = Annotated[int, Field(ge=1, le=1000)]
Modes = Annotated[int, Field(ge=1, le=1000)]
Tolerance = Annotated[float, Field(gt=0.0, lt=1.0)]
PositionBasis = Literal["pod", "skinning"]


class Horizon(ConfigModel):
    """Up to which frame a run is judged: the spread of the runs perturbed by ``perturbation``.

    The horizon is the first frame at which the spread exceeds ``threshold``.
    """

    perturbation: Tolerance
    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

    def frames(self, perturbed: File, run: str = "train") -> int:
        """Frames before the horizon of a scene's ``run``, from the table of its perturbed runs."""
        label = self.perturbation if run == "train" else run
        spread = floor_of(read_table(perturbed.path), perturbed["scene"], label)
        return horizon(spread, self.threshold)


Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]


def resolve_ranks(ranks: Sequence[Rank], rank: int) -> list[int]:
    """``ranks`` ascending, "full" replaced by the numerical ``rank`` (left out if 0)."""
    full = [rank] if "full" in ranks and rank > 0 else []
    return sorted({*(int(r) for r in ranks if r != "full"), *full})
