"""Table asks: runs that were asked for an error, on motions that no choice has seen."""

import pandas as pd

from pdrom.artifact.reads import Every, Setting
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from pdrom.tables.kit.families import families
from pdrom.tables.kit.parts import joined
from pdrom.tables.kit.vocabulary import MS_PER_FRAME, SCENE, VERTICES


@table(
    title="Asked errors and those that were reached",
    columns=(
        SCENE,
        text("motion", "held-out motion that was run"),
        compared("exact", number("asked", "largest relative error of the positions asked for")),
        VERTICES,
        integer("frames", "frames before the horizon, which the promise is for"),
        compared("error", flag("judged", "frames enough to tell a kept promise from a broken one")),
        compared("value", number("factor", "on estimates, by the scores of other scenes")),
        compared("value", number("risk", "bound on the share of promises broken that it has")),
        compared("error", flag("promised", "the run says that it keeps to the ask")),
        compared("error", flag("reduced", "a reduction did at least one frame")),
        number("error", "error against the converged implicit step"),
        number("velocity_error", "error of the velocities, likewise"),
        compared("error", number("expected", "error on own motions, times the factor")),
        compared("error", number("estimate", "estimate by the run's checks, times the factor")),
        compared("error", flag("broken", "promised and judged, and the error is above the ask")),
        compared("error", text("first_step", "way to do a frame that the run began with")),
        compared("error", text("last_step", "the one it ended with")),
        compared("error", integer("reduced_frames", "frames done by a reduction")),
        compared("error", integer("checks", "frames done by the full order as well")),
        compared("error", integer("repairs", "how often the run went back")),
        MS_PER_FRAME,
        compared("error", text("full_step", "cheapest full order chosen by the same rule")),
        number("full_error", "its error"),
        timed(number("full_ms", "time of its frame", "ms")),
        timed(number("own_ms", "time of a frame with the scene's own iterations", "ms")),
        timed(text("oracle_step", "fastest way that keeps to the ask, by hindsight")),
        timed(number("oracle_ms", "time of its frame", "ms")),
    ),
    reads={
        "runs": Every(paths.ASKS),
        "scores": Every(paths.ASK_SCORES),
        "risk": Setting("asks.risk"),
    },
)
def asks(runs: list[File], scores: list[File], risk: float) -> pd.DataFrame:
    """Rows of the ``runs`` of all scenes, each with the factor that ``scores`` of others give.

    Others are neither the scene nor its twin. The factor has this ``risk`` of broken promises.
    """
    rows, scored = joined(runs), joined(scores)
    if rows.empty:
        return rows
    parts = []
    for family, own in rows.groupby(families(rows.scene), sort=False):
        others = scored[families(scored.scene) != family]
        factor, bound = risk_factor(others, risk)
        parts.append(own[own.factor == factor].assign(risk=bound))
    made = pd.concat(parts).sort_index().reset_index(drop=True)
    counts = made.promised.astype(bool) & made.judged.astype(bool)
    return made.assign(broken=counts & ~(made.error <= made.asked), reduced=made.reduced_frames > 0)


def risk_factor(scored: pd.DataFrame, risk: float) -> tuple[float, float]:
    """Smallest factor at which a new scene breaks a promise with probability ``risk``.

    Each scene's loss is the share of its asks that the chosen step would break on the motion that
    the choice has not seen; a scene and its twin are one, with the mean of their losses. With n of
    them the mean of all losses and of a loss of 1 bounds the expected loss of a new one (conformal
    risk control, Angelopoulos et al. 2024).

    Parameters
    ----------
    scored : of every scene, ask and factor the error that was reached; nan without a promise

    Returns
    -------
    The factor, the largest one where none does, and the bound that holds for it.
    """
    broken = scored.step.notna() & ~(scored.error <= scored.asked)
    family = families(scored.scene).rename("family")
    scenes = broken.groupby([scored.factor, family, scored.scene]).mean()
    losses = scenes.groupby(level=["factor", "family"]).mean().unstack()
    # a larger factor may lead to a worse step: the worst of all larger ones cannot rise
    worst = losses[::-1].cummax()[::-1]
    bounds = (worst.sum(axis=1) + 1.0) / (losses.shape[1] + 1)
    kept = bounds.index[bounds <= risk]
    factor = kept[0] if len(kept) else bounds.index[-1]
    return float(factor), float(bounds[factor])
