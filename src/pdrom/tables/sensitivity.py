"""Table sensitivity: how far runs drift apart that should be the same."""

import pandas as pd

from pdrom.artifact.reads import Every
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.tables.kit.declaration import compared, integer, number, table, text
from pdrom.tables.kit.parts import joined
from pdrom.tables.kit.vocabulary import SCENE


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
