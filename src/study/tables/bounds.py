"""Table bounds: what is known of a reduced run beforehand, beside what became of it."""

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, TableOf
from study.tables.kit.declaration import compared, number, table
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import ERROR_WITHIN, FINITE, GROUP, MAX_EXTENT, METHOD, SCENE, R

_KEYS = ["scene", "group", "method", "r"]


@table(
    title="A-priori bounds of reduced runs, and how an iteration treats a small error",
    columns=(
        SCENE,
        GROUP,
        METHOD,
        R,
        compared(
            "value",
            number("reach", "bound of the static displacement by the projections, in rest extents"),
        ),
        number("growth", "bound of the dynamic displacement over it, over the frames of the run"),
        number(
            "lasting_growth",
            "the same for ever, with the vertices that are held last; inf if none is proved",
        ),
        compared(
            "value",
            number(
                "bound", "bound of the extent of the run, in rest extents; inf if there is none"
            ),
        ),
        MAX_EXTENT,
        compared("error", number("slack", "bound over largest extent")),
        compared(
            "error",
            number("contraction", "how much an iteration may enlarge an error, in the norm of A"),
        ),
        compared("error", number("spectral_radius", "of the derivative of an iteration")),
        compared(
            "error",
            number(
                "small_gain", "growth times contraction; a small-gain argument needs less than one"
            ),
        ),
        FINITE,
        ERROR_WITHIN,
    ),
    reads={"parts": Every(paths.BOUNDS), "reruns": TableOf("reduced_reruns")},
)
def bounds(parts: list[File], reruns: pd.DataFrame) -> pd.DataFrame:
    """One row of ``parts`` per scene, group, method and r, beside the run in ``reruns``.

    contraction and spectral_radius are the largest of two states of the full-order run; empty where
    several groups act, and for scenes too large for dense matrices. The bounds need that no
    contact acts, which is not looked at, and are empty where the scene is outside of the rest of
    the premise (`study.experiments.kit.premise`; the job's log says why), or the method clips its
    coefficients.
    """
    known = joined(parts)
    if known.empty:
        return known
    runs = reruns[reruns.position_basis == "full"]
    runs = runs[[*_KEYS, "max_extent", "finite", "relative_error_within_horizon"]]
    table = known.astype({"r": "int64"}).merge(runs.astype({"r": "int64"}), on=_KEYS, how="left")
    extent = table.max_extent.astype(float)
    table["slack"] = table.bound.astype(float) / extent.where(extent > 0.0, np.nan)
    table["small_gain"] = table.growth.astype(float) * table.contraction.astype(float)
    return table
