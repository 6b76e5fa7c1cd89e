"""Table machine_rates: what one thread of this machine can do at most."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.tables.kit.declaration import compared, number, table, text, timed
from study.tables.kit.parts import joined


@table(
    title="Rates of this machine, one thread",
    columns=(
        text("quantity", "what is done: bytes read, or operations on doubles, four at a time"),
        number("working_set", "what is read over and over", "B"),
        compared(
            "timed",
            text("level", "smallest cache that holds the working set, as the system reports"),
        ),
        timed(number("rate", "median of the repeats", "1e9/s")),
        timed(number("low", "their first quartile", "1e9/s")),
        timed(number("high", "their third quartile", "1e9/s")),
    ),
    reads={"parts": Every(paths.RATES)},
)
def machine_rates(parts: list[File]) -> pd.DataFrame:
    """Bytes by working set, then operations, of ``parts``."""
    return joined(parts)
