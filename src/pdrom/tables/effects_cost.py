"""Table effects_cost: what each effect of a scene costs."""

import pandas as pd

from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.core.reads import Every
from pdrom.tables.declaration import integer, number, table, text, timed
from pdrom.tables.parts import joined
from pdrom.tables.vocabulary import MS_PER_FRAME, SCENE


@table(
    title="Cost of each effect in a full-order frame",
    columns=(
        SCENE,
        text("effect", "name of the effect; the global solve and the rest have rows, too"),
        integer("elements", "elements of a group, vertices of another effect"),
        MS_PER_FRAME,
        timed(number("share", "of the frame; those of a scene add up to one")),
    ),
    reads={"parts": Every(paths.EFFECTS)},
)
def effects_cost(parts: list[File]) -> pd.DataFrame:
    """The scenes' tables one after the other."""
    return joined(parts)
