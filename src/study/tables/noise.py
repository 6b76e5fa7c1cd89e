"""Table noise: reductions on bases of round-off, one row per start, method and size."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import BLOWUP_FRAME, FINITE, FRAMES, GAIN, GROUP, METHOD, SCENE, R


@table(
    title="Runs on bases of round-off",
    columns=(
        SCENE,
        GROUP,
        text(
            "noisy_axes",
            "what the start's round-off reaches: all axes; of a flat mesh its plane, or this and "
            "the axis across it at one vertex",
        ),
        integer("seed", "of the start's round-off"),
        METHOD,
        R,
        compared("value", integer("rank", "modes that the snapshots have without a cutoff")),
        # the modes are made of round-off
        compared("skipped", GAIN),
        FRAMES,
        FINITE,
        BLOWUP_FRAME,
        number(
            "relative_error", "error of the positions over all frames, which end at the horizon"
        ),
    ),
    reads={"parts": Every(paths.NOISE)},
)
def noise(parts: list[File]) -> pd.DataFrame:
    """Rows of all scenes, in the order of their ``parts``."""
    return joined(parts)
