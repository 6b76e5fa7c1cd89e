"""Table effects_contribution: what each effect of a scene does, and what it costs."""

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.horizon import floor_of, horizons
from study.experiments.kit.sensitivity import without
from study.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import FLOOR, SCENE

KEYS = ["scene", "effect"]


@table(
    title="What each effect contributes to a full-order run",
    columns=(
        SCENE,
        text("effect", "name of the effect"),
        text("role", "constraint group, force, contact, hold or start"),
        number("force", "root mean square over the frames of the norm of its force", "N"),
        number("force_share", "of the sum over the effects of the scene"),
        compared("error", integer("acting_frames", "frames in which it exerts a force at all")),
        number("energy", "range of the energy that it holds, where it has one", "J"),
        compared(
            "error",
            number("moved", "how far the run moves without it: largest drift before the horizon"),
        ),
        FLOOR,
        compared("error", flag("above_floor", "moved is larger than the sensitivity floor")),
        timed(number("own_ms", "its time in a frame of the whole scene", "ms")),
        timed(
            number("saved_ms", "time of the whole scene less that of the scene without it", "ms")
        ),
    ),
    reads={
        "parts": Every(paths.CONTRIBUTIONS),
        "sensitivity": TableOf("sensitivity"),
        "perturbation": Setting("sensitivity.reference"),
        "threshold": Setting("sensitivity.threshold"),
        "costs": TableOf("effects_cost"),
        "left_out": TableOf("effects_left_out"),
    },
)
def effects_contribution(
    parts: list[File],
    sensitivity: pd.DataFrame,
    perturbation: float,
    threshold: float,
    costs: pd.DataFrame,
    left_out: pd.DataFrame,
) -> pd.DataFrame:
    """One row per scene and effect of ``parts``.

    The only group of a scene cannot be left out: ``moved`` is empty. Times are those of the tables
    effects_cost and effects_left_out, the latter of scenes with several groups only: ``costs`` and
    ``left_out``. ``sensitivity``, ``perturbation`` and ``threshold`` are those of `horizons`.
    """
    frames = joined(parts)
    if not len(frames):
        return frames
    made = frames.groupby([*KEYS, "role"], sort=False, as_index=False).agg(
        force=("force", _root_mean_square),
        acting_frames=("force", lambda force: int((force > 0.0).sum())),
        energy=("energy", _range),
    )
    length = frames.groupby("scene").frame.max() + 1
    # a start has a row in the first frame only
    starts = made.role == "start"
    made.loc[starts, "force"] /= np.sqrt(made.scene[starts].map(length).to_numpy(float))
    made["force_share"] = made.force / made.groupby("scene").force.transform("sum")
    ends = horizons(sensitivity, perturbation, threshold)
    made["sensitivity_floor"] = [
        _largest(sensitivity, scene, perturbation, ends) for scene in made.scene
    ]
    made["moved"] = [
        _largest(sensitivity, row.scene, without(row.effect), ends) for row in made.itertuples()
    ]
    judged = made.moved.notna()
    made["above_floor"] = (made.moved > made.sensitivity_floor).where(judged, None).astype(object)
    own = costs.set_index(KEYS).ms_per_frame
    single = left_out.rename(columns={"left_out": "effect"}).set_index(KEYS)
    keys = pd.MultiIndex.from_frame(made[KEYS])
    made["own_ms"] = own.reindex(keys).to_numpy()
    made["saved_ms"] = single.saved_ms.reindex(keys).to_numpy() if len(single) else np.nan
    return made


def _root_mean_square(values: pd.Series) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _range(values: pd.Series) -> float:
    return float(values.max() - values.min()) if len(values) > 1 else float(values.iloc[0])


def _largest(
    sensitivity: pd.DataFrame, scene: str, label: float | str, ends: dict[str, int]
) -> float | None:
    """Largest drift before the horizon; None where there was no such run, or no such frame."""
    drift = floor_of(sensitivity, scene, label)[: ends[scene]]
    return float(drift.max()) if len(drift) else None
