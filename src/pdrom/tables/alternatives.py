"""Table alternatives: projective dynamics, what else there is, and a reduction, on one scene."""

import pandas as pd

from pdrom.artifact.reads import Every
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.experiments.alternatives.settings import ACCELERATED, CONVERGED, OWN, REDUCED
from pdrom.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from pdrom.tables.kit.parts import joined
from pdrom.tables.kit.vocabulary import ELEMENTS_SAMPLED, MS_PER_FRAME, SCENE, VERTICES, K

STIFFNESS = compared("exact", number("stiffness", "factor on all weights of the scene"))
SUBSTEPS = integer("substeps", "steps that a frame is divided into")
ITERATIONS = integer("iterations", "iterations of each substep")

TRAINED_ON = text("trained_on", f"frames that a reduction is trained on: {OWN}, {CONVERGED}")


@table(
    title="Error and time of the alternatives to projective dynamics",
    columns=(
        SCENE,
        compared("exact", number("factor", "on the vertices along a side of the scene's own mesh")),
        VERTICES,
        STIFFNESS,
        text(
            "method",
            f"how a frame is solved; {CONVERGED}: to the end; {REDUCED}: reduced, {ACCELERATED}: "
            "and accelerated in the subspace",
        ),
        SUBSTEPS,
        ITERATIONS,
        TRAINED_ON,
        K,
        ELEMENTS_SAMPLED,
        integer("frames", "frames that errors are taken over"),
        compared("error", flag("finite", "no frame blew up")),
        MS_PER_FRAME,
        timed(number("ms_low", "the same of the fastest repeat", "ms")),
        timed(number("ms_high", "the same of the slowest repeat", "ms")),
        number("error_implicit", "error against the converged implicit step of the scene"),
        number("error_continuous", "error against the motion in continuous time: the total error"),
        number("reference_error", "estimated error of that motion"),
    ),
    reads={"parts": Every(paths.ALTERNATIVES)},
)
def alternatives(parts: list[File]) -> pd.DataFrame:
    """Rows of all scenes and meshes, in the order of their ``parts``; the held-out motion."""
    return joined(parts)
