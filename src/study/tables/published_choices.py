"""Table published_choices: errors with the published code's choices, beside its own output."""

from pathlib import Path

import numpy as np
import pandas as pd

from pdrom.core.store import read_table
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, ProjectFile
from study.tables.kit.declaration import compared, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import GROUP, SCENE, R

KEYS = ["experiment", "group", "axis", "r"]
STORED = [
    "experiment", "group", "split", "num_points",
    "relative_error_x", "relative_error_y", "relative_error_z",
]  # fmt: skip
DIRECTION = text(
    "direction",
    "choices added one after the other (cumulative), each alone, or all of them with the signs of "
    "the modes, or the rows picked among equal ones, drawn (signs, ties)",
)
CHOICE = text("choice", "choice of the published code that is added, or the draw")


@table(
    title="Choices of the published code, one after the other",
    columns=(
        SCENE,
        GROUP,
        text("experiment", "what the stored output of the published code calls the scene"),
        DIRECTION,
        CHOICE,
        text("axis", "x, y or z"),
        R,
        # LAPACK's signs and the choice among equal residuals are rounding, so that all of it is
        compared("skipped", number("error", "reconstruction error of the training snapshots")),
        number("reference", "the same in the stored output of the published code"),
        compared("skipped", number("log_ratio", "decimal logarithm of the error over it")),
    ),
    reads={
        "parts": Every(paths.PUBLISHED_CHOICES),
        "stored": ProjectFile("config/reference/published_code/reconstruction_error.csv"),
    },
)
def published_choices(parts: list[File], stored: Path) -> pd.DataFrame:
    """Rows of all cases, ``parts``, in order; without a reference where ``stored`` has none."""
    rows = joined(parts)
    if rows.empty:
        return rows
    references = _references(read_table(stored, STORED, result=False))
    found = rows.merge(references, on=KEYS, how="left", validate="many_to_one")
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log10(found.error / found.reference)
    return found.assign(log_ratio=ratio.where(np.isfinite(ratio)))


def _references(stored: pd.DataFrame) -> pd.DataFrame:
    """The errors of the training snapshots, a row for each axis."""
    train = stored[stored.split == "train"].rename(columns={"num_points": "r"})
    columns = {f"relative_error_{axis}": axis for axis in "xyz"}
    train = train.rename(columns=columns)[["experiment", "group", "r", *"xyz"]]
    return train.melt(["experiment", "group", "r"], var_name="axis", value_name="reference")
