"""Table sensitivity: how far runs drift apart that should be the same."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import SCENE


@table(
    title="Drift of perturbed full-order runs",
    columns=(
        SCENE,
        text("perturbation", "of the start, over the extent; or what else was changed"),
        integer("frame", "number of the frame, from 0"),
        compared("error", number("relative_difference", "largest over the seeds")),
    ),
    reads={"parts": Every(paths.SENSITIVITY)},
)
def sensitivity(parts: list[File]) -> pd.DataFrame:
    """Largest difference of ``parts`` over the seeds, per scene, perturbation and frame."""
    keys = ["scene", "perturbation", "frame"]
    rows = joined(parts).groupby(keys, sort=False, as_index=False)
    return rows["relative_difference"].max()
