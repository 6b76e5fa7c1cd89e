"""Table certified: bounds of frames, and estimates of errors by residuals, on held-out motions."""

import pandas as pd

from pdrom.artifact.reads import Every
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from pdrom.tables.kit.parts import joined
from pdrom.tables.kit.vocabulary import SCENE


@table(
    title="Certified frames, and estimates of the error from residuals",
    columns=(
        SCENE,
        text("motion", "held-out motion that was run"),
        compared("error", text("step", "way to do a frame")),
        flag("reduced", "it is a reduction"),
        compared("error", integer("frames", "before the horizon and before any contact")),
        number("error", "error of the positions in these, against the converged implicit step"),
        compared("error", integer("probed", "frames among them that the full order did, too")),
        compared("share", number("convex", "share of these with a contraction number below one")),
        compared("share", number("certified", "share whose residual alone gives a bound")),
        compared("error", number("slack", "that bound over the defect, median")),
        compared("share", number("checks_certified", "share whose full-order frame has a bound")),
        compared("error", number("checks_slack", "defect plus that bound over the defect, median")),
        flag("held", "no defect is above its bound"),
        compared("error", number("growth", "bound on that of an error in a frame, median")),
        compared("error", number("asked", "estimate by defects over the error, factor 1")),
        compared("error", number("ratio", "estimate by residuals over the error")),
        compared("error", number("log_chained", "decimal logarithm of the chained estimate's")),
        timed(number("cost", "time of a bound by the residual over that of a full-order frame")),
        timed(number("check_cost", "the same of a check with its bound")),
    ),
    reads={"parts": Every(paths.CERTIFIED)},
)
def certified(parts: list[File]) -> pd.DataFrame:
    """A row for each scene, motion and way to do a frame."""
    return joined(parts)
