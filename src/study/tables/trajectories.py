"""Tables of the test trajectories, and of the sources of error of reduced models on them."""

import numpy as np
import pandas as pd

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.experiments.error_budget import FULL_ORDER, PARTS, SPAN
from study.tables.kit import declaration, results
from study.tables.kit.declaration import flag, integer, number, shared, table, text
from study.tables.kit.results import Rows

MOTION = text("motion", f"test trajectory, one of: {', '.join(MOTIONS)}")


@table(
    title="Distance of test trajectories from rigid motions and from the training",
    columns=(
        *shared("scene"),
        MOTION,
        integer("frames", "number of frames of the run", compared="exact"),
        *shared("horizon_frame"),
        number(
            "deformation",
            "distance of the converged run from the best rigid motions of the rest shape, over "
            "the norm of the displacement, all frames",
        ),
        number("affine", "as deformation, but from the best affine maps", compared="error"),
        *shared("reference"),
        number("replay_error", "position error if the training trajectory is replayed instead"),
        number("replay_deformation_error", "deformation error if the training is replayed"),
        number("full_order_error", "position error of the run with the scene's iterations"),
        number("full_order_deformation_error", "deformation error of this full-order run"),
        *shared("reference_error reference_deformation_error"),
        number("evaluations", "solver evaluations per frame, converged run", compared="error"),
    ),
    reads={"rows": Rows(paths.REFERENCES)},
)
def test_trajectories(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene and test trajectory; errors against converged runs, before the horizon."""
    return rows[rows.motion != results.TRAIN].assign(reference=declaration.CONVERGED)


@table(
    title="Error budget of reduced models: error added by each source",
    columns=(
        *shared("scene"),
        MOTION,
        integer("k", "requested POD modes; the training trajectory may have fewer"),
        integer("skinning", "number of skinning columns added to the modes"),
        *shared("elements_sampled"),
        integer("frames", "number of frames before the horizon, over which errors are taken"),
        text(
            "part",
            "span: best approximation in the subspace; closure: converged step in the subspace, "
            "all elements; sampling: with sampled elements; run: five local-global iterations; "
            "full_order: full-order run with the scene's iterations",
        ),
        *shared("reference"),
        number("error", "position error"),
        *shared("deformation_error"),
        number("added", "deformation error minus that of the part before", compared="error"),
        flag("largest", "the part adds most, and more than 3 times the reference's error"),
        *shared("reference_error reference_deformation_error"),
    ),
    reads={"rows": Rows(paths.ERROR_BUDGET), "references": Rows(paths.REFERENCES)},
)
def error_budget(rows: pd.DataFrame, references: pd.DataFrame) -> pd.DataFrame:
    """One row per test trajectory, model and part; parts of a reduced model follow one another.

    If the reference moves rigidly, ``added`` is a difference of position errors.
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
