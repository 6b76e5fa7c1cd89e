"""Table large_meshes: who wins on meshes that are too large for a default run, as recorded once."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from study.artifact.reads import ProjectFile
from study.tables.kit.declaration import table, text
from study.tables.winners import winners

RECORDED = "config/reference/large_meshes/winners.csv"
# The record is older than reductions trained on converged frames, intervals, and other motions.
LATER = (
    "motion", "reduced_method", "reduced_trained_on", "reduced_iterations", "own_ms",
    "reduced_speedup_low", "reduced_speedup_high",
)  # fmt: skip


# Nothing is measured here, hence nothing is timed: the same file gives the same table.
@table(
    title="Who reaches an error in the shortest time on larger meshes, recorded",
    columns=(
        *(
            replace(column, timed=False, declared=None)
            for column in winners.columns
            if column.name not in LATER
        ),
        text("processor", "of the machine that the times belong to"),
        text("date", "day of the record"),
    ),
    reads={"recorded": ProjectFile(RECORDED)},
)
def large_meshes(recorded: Path) -> pd.DataFrame:
    """The rows of the table winners of the study ``config/extended.yaml``."""
    return pd.read_csv(recorded)
