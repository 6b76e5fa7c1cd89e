"""Table alternatives: projective dynamics, what else there is, and a reduction, on one scene."""

import pandas as pd

from pdrom.model.held_out import MOTIONS
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.experiments.alternatives import settings
from study.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import ELEMENTS_SAMPLED, MS_PER_FRAME, SCENE, VERTICES, K

STIFFNESS = compared("exact", number("stiffness", "factor on all weights of the scene"))
SUBSTEPS = integer("substeps", "steps that a frame is divided into")
ITERATIONS = integer("iterations", "iterations of each substep")

MOTION = text("motion", f"held-out motion, one of: {', '.join(MOTIONS)}")
# What tells candidates apart, whatever the motion.
CANDIDATE = ["scene", "factor", "stiffness", *settings.SETTING]
TRAINED_ON = text(
    "trained_on", f"frames that a reduction is trained on: {settings.OWN}, {settings.CONVERGED}"
)

# Rounding decides which iterate of a two-level iteration is refused: its errors have few digits.
LOOSE = 0.3


@table(
    title="Error and time of the alternatives to projective dynamics",
    columns=(
        SCENE,
        compared("exact", number("factor", "on the vertices along a side of the scene's own mesh")),
        VERTICES,
        STIFFNESS,
        text(
            "method",
            f"how a frame is solved; {settings.CONVERGED}: to the end; {settings.REDUCED}: "
            f"reduced, {settings.ACCELERATED}: and accelerated in the subspace",
        ),
        SUBSTEPS,
        ITERATIONS,
        TRAINED_ON,
        K,
        ELEMENTS_SAMPLED,
        MOTION,
        integer("frames", "frames that errors are taken over"),
        compared("error", flag("finite", "no frame blew up")),
        MS_PER_FRAME,
        timed(number("ms_low", "the same in the fastest process", "ms")),
        timed(number("ms_high", "the same in the slowest process", "ms")),
        integer("processes", "processes that timed it, all in the first motion"),
        compared("error", number("error_implicit", "against the converged step"), LOOSE),
        compared("error", number("error_continuous", "against continuous time: the total"), LOOSE),
        number("reference_error", "estimated error of that motion"),
    ),
    reads={"parts": Every(paths.ALTERNATIVES), "times": Every(paths.ALTERNATIVE_TIMES)},
)
def alternatives(parts: list[File], times: list[File]) -> pd.DataFrame:
    """Rows of all scenes and meshes, in the order of their ``parts``; held-out motions.

    ``times`` are those of every process; their medians count.
    """
    rows = joined(parts)
    if rows.empty:
        return rows
    rows, processes = beside(rows, joined(times))
    ms = rows[processes]
    return rows.assign(
        ms_per_frame=ms.median(axis=1),
        ms_low=ms.min(axis=1),
        ms_high=ms.max(axis=1),
        processes=ms.count(axis=1),
    )


def beside(rows: pd.DataFrame, times: pd.DataFrame) -> tuple[pd.DataFrame, list[int]]:
    """``rows`` with a column of ``times`` (ms) for each process, and the names of these columns."""
    wide = times.set_index([*CANDIDATE, "process"]).ms_per_frame.unstack("process")
    words = {"trained_on": object}  # where nothing is reduced, it would be a number
    both = (table.astype(words) for table in (rows, wide.reset_index()))
    return pd.merge(*both, on=CANDIDATE, how="left"), list(wide.columns)
