"""Tables of the test trajectories, and of what keeps a reduced model from following them."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.experiments.error_budget import FULL_ORDER, PARTS, SPAN
from study.tables.kit import declaration, results
from study.tables.kit.declaration import flag, integer, number, shared, table, text
from study.tables.kit.results import Rows

MOTION = text("motion", f"how it differs from the training one: {', '.join(MOTIONS)}")


@table(
    title="Test trajectories: how far from rigid, and from the training",
    columns=(
        *shared("scene"),
        MOTION,
        integer("frames", "frames of the run", compared="exact"),
        *shared("horizon_frame"),
        number(
            "deformation",
            "norm of what the best rigid motions of the rest shape leave of the converged run, "
            "over the norm of the displacement, in all frames",
        ),
        number("affine", "the same, if the best affine motions are taken out", compared="error"),
        *shared("reference"),
        number("replay_error", "position error if the training trajectory is replayed instead"),
        number("replay_deformation_error", "deformation error of the replay"),
        number("full_order_error", "position error of the run with the scene's iterations"),
        number("full_order_deformation_error", "its deformation error"),
        *shared("reference_error reference_deformation_error"),
        number("evaluations", "evaluations of a frame of the converged run", compared="error"),
    ),
    reads={"rows": Rows(paths.REFERENCES)},
)
def test_trajectories(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene and held-out motion; errors are before the horizon, of converged runs."""
    return rows[rows.motion != results.TRAIN].assign(reference=declaration.CONVERGED)


@table(
    title="Error budget of reduced models",
    columns=(
        *shared("scene"),
        MOTION,
        integer("k", "POD modes that are asked for; a recording may hold fewer"),
        integer("skinning", "skinning columns beside them"),
        *shared("elements_sampled"),
        integer("frames", "frames that errors are taken over: those before the horizon"),
        text(
            "part",
            "span: best approximation in the subspace; closure: the converged step in it, with all "
            "elements; sampling: with the sampled ones; run: five local/global iterations; "
            "full_order: the full order with the scene's iterations",
        ),
        *shared("reference"),
        number("error", "position error"),
        *shared("deformation_error"),
        number("added", "deformation error less that of the part before", compared="error"),
        flag("largest", "the part adds most, and more than 3 x the reference's own error"),
        *shared("reference_error reference_deformation_error"),
    ),
    reads={"rows": Rows(paths.ERROR_BUDGET), "references": Rows(paths.REFERENCES)},
)
def error_budget(rows: pd.DataFrame, references: pd.DataFrame) -> pd.DataFrame:
    """One row per test trajectory, model and part; parts of a reduced model follow one another.

    Where the reference moves rigidly, ``added`` is that of the position error.
    """
    error = rows[results.DEFORMATION].fillna(rows.error).fillna(np.inf)
    before = error.shift().where(rows.part != SPAN, 0.0)
    with np.errstate(invalid="ignore"):
        added = (error - before).where(rows.part != FULL_ORDER)
    most = added == added.groupby(np.arange(len(rows)) // len(PARTS)).transform("max")
    known = references[["scene", "motion", *results.OWN_ERRORS]]
    rows = rows.assign(added=added).merge(known, "left", ["scene", "motion"])
    least = rows.reference_deformation_error.fillna(rows.reference_error) / results.THIRD
    return rows.assign(largest=most & (rows.added > least), reference=declaration.CONVERGED)
