"""Table reconstruction_error: all methods, sizes and splits."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import ELEMENTS_SAMPLED, GAIN, GROUP, METHOD, SCENE, R

_SMALL = "empty at round-off level"


@table(
    title="Reconstruction error of every method and size",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        R,
        text("split", "snapshots that are reconstructed: train, test, heldout"),
        number("relative_error", f"of the projections; {_SMALL}"),
        number("relative_error_x", f"of their x-coordinates; {_SMALL}"),
        number("relative_error_y", f"of their y-coordinates; {_SMALL}"),
        number("relative_error_z", f"of their z-coordinates; {_SMALL}"),
        GAIN,
        compared("value", integer("rows_sampled", "rows of the projections that are evaluated")),
        ELEMENTS_SAMPLED,
    ),
    reads={"parts": Every(paths.RECONSTRUCTION)},
)
def reconstruction_error(parts: list[File]) -> pd.DataFrame:
    """Rows of all methods, in the order of their ``parts``."""
    return joined(parts)
