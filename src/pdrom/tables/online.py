"""Table online: large hyper-reduced scenes, one row per scene, basis, size and tolerance."""

import pandas as pd

from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.core.reads import Every
from pdrom.tables.declaration import integer, number, table, timed
from pdrom.tables.parts import joined
from pdrom.tables.vocabulary import (
    ELEMENTS_SAMPLED,
    MS_PER_FRAME,
    POSITION_BASIS,
    SCENE,
    SPEEDUP,
    VERTICES,
    K,
)


@table(
    title="Large scenes in position subspaces with sampled elements",
    columns=(
        SCENE,
        VERTICES,
        integer("elements", "elements of all groups"),
        POSITION_BASIS,
        K,
        number("tau", "tolerance of the element sampling"),
        ELEMENTS_SAMPLED,
        number("relative_error_train", "error of the positions in the training motion"),
        number("relative_error_heldout", "the same in the held-out motion"),
        MS_PER_FRAME,
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        timed(number("fom_ms_per_frame", "time of a frame of the full-order run", "ms")),
        SPEEDUP,
    ),
    reads={"parts": Every(paths.ONLINE)},
)
def online(parts: list[File]) -> pd.DataFrame:
    """Rows of all scenes, in order."""
    return joined(parts)
