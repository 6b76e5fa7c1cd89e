"""Table singular_values: decay of the centred training snapshots of each group."""

import pandas as pd

from pdrom.reduction.basis import load_basis
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Preferred
from study.tables.kit.declaration import flag, integer, number, table
from study.tables.kit.vocabulary import GROUP, SCENE


@table(
    title="Singular values of the training snapshots",
    columns=(
        SCENE,
        GROUP,
        integer("component", "number of the mode, from 1"),
        number("singular_value", "of the snapshot matrix", "that of the group's projections"),
        number("relative", "over the first one"),
        flag("above_roundoff", "larger than the rounding errors of the projections"),
    ),
    # of an experiment's bases the one without weights and centring: every study may hold others
    reads={"bases": Preferred(paths.BASIS, "basis", "none-none-vectorised")},
)
def singular_values(bases: list[File]) -> pd.DataFrame:
    """Rows of all bases, in order."""
    parts = []
    for file in bases:
        basis = load_basis(file.path)
        sigma = basis.singular_values
        parts.append(
            pd.DataFrame(
                {
                    "scene": file["scene"],
                    "group": file["group"],
                    "component": range(1, len(sigma) + 1),
                    "singular_value": sigma,
                    "relative": sigma / sigma[0] if sigma[0] > 0.0 else float("nan"),
                    "above_roundoff": [i < basis.rank for i in range(len(sigma))],
                }
            )
        )
    return pd.concat(parts, ignore_index=True)
