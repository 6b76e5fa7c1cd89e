"""Table heldout_reruns: errors of the reruns on motions that no basis and no sampling has seen."""

import pandas as pd

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.tables.kit.declaration import table, text
from study.tables.kit.reruns import COLUMNS, MEASURES, judged_reruns


@table(
    title="Reduced runs of the held-out motions",
    columns=(
        *COLUMNS,
        *MEASURES,
        text("motion", f"how the motion differs from the training one: {', '.join(MOTIONS)}"),
    ),
    reads={
        "runs": Every(paths.RERUNS),
        "rows": Every(paths.RERUNS_HELDOUT),
        "subspaces": Every(paths.SUBSPACES),
        "subspace_rows": Every(paths.SUBSPACES_HELDOUT),
        "sensitivity": TableOf("sensitivity"),
        "threshold": Setting("sensitivity.threshold"),
    },
)
def heldout_reruns(
    runs: list[File],
    rows: list[File],
    subspaces: list[File],
    subspace_rows: list[File],
    sensitivity: pd.DataFrame,
    threshold: float,
) -> pd.DataFrame:
    """Runs judged by the horizon of their own motion, see `judged_reruns`."""
    found = [
        judged_reruns(
            runs,
            rows,
            subspaces,
            subspace_rows=subspace_rows,
            sensitivity=sensitivity,
            perturbation=name,
            threshold=threshold,
            motion=name,
        ).assign(motion=name)
        for name in MOTIONS
    ]
    return pd.concat(found, ignore_index=True)
