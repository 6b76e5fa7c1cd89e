"""Table effects_cost: what each effect of a scene costs, and what it contributes."""

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.horizon import floor_of, horizons
from study.experiments.kit.names import GLOBAL, REST, RIGHT
from study.experiments.kit.sensitivity import without
from study.tables.kit.declaration import compared, flag, integer, number, table, text, timed
from study.tables.kit.parts import in_one_time, joined
from study.tables.kit.vocabulary import FLOOR, MS_PER_FRAME, SCENE

KEYS = ["scene", "effect"]
NOTHING = "nothing"  # left out: the whole scene
PHASE, SEVERAL = "phase", "several"


@table(
    title="Cost and contribution of each effect in a full-order run",
    columns=(
        SCENE,
        text(
            "effect",
            "name of the effect; right-hand side, global solve and the rest have rows, too, and "
            f"what is left out together, or {NOTHING}",
        ),
        text(
            "role",
            "constraint group, force, contact, hold or start; "
            f"{PHASE}: no effect; {SEVERAL}: left out together",
        ),
        integer("elements", "elements of a group, vertices of another effect"),
        MS_PER_FRAME,
        timed(number("share", "of the frame; those of a scene add up to one")),
        integer("groups", "constraint groups of the scene that is built without it"),
        timed(number("without_ms", "time of a frame of the scene that is built without it", "ms")),
        timed(number("saved_ms", "time of the whole scene less that", "ms")),
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
    ),
    reads={
        "parts": Every(paths.EFFECTS),
        "left_out": Every(paths.LEFT_OUT),
        "contributions": Every(paths.CONTRIBUTIONS),
        "frame_times": TableOf("frame_times"),
        "sensitivity": TableOf("sensitivity"),
        "perturbation": Setting("sensitivity.reference"),
        "threshold": Setting("sensitivity.threshold"),
    },
)
def effects_cost(
    parts: list[File],
    left_out: list[File],
    contributions: list[File],
    frame_times: pd.DataFrame,
    sensitivity: pd.DataFrame,
    perturbation: float,
    threshold: float,
) -> pd.DataFrame:
    """Effects and phases of each scene, then what was left out together in scenes of many groups.

    Parameters
    ----------
    parts, left_out : times of effects, and of scenes without some of them; they are brought to
        those of the table ``frame_times``
    contributions : forces and energies by frame
    sensitivity, perturbation, threshold : see `horizons`; ``moved`` is empty for the only group of
        a scene, which cannot be left out
    """
    costs, removed = joined(parts), joined(left_out)
    if costs.empty:
        return costs
    own = costs.groupby("scene").ms_per_frame.sum()
    costs = in_one_time(costs, own, frame_times, columns=["ms_per_frame"])
    tables = [costs]
    if len(removed):
        whole = removed[removed.left_out == NOTHING].set_index("scene").ms_per_frame
        times = ["ms_per_frame", "saved_ms", "own_ms"]
        removed = in_one_time(removed, whole, frame_times, columns=times)
        removed = removed.rename(columns={"left_out": "effect", "ms_per_frame": "without_ms"})
        several = removed.rename(columns={"own_ms": "ms_per_frame"})
        tables.append(several[_absent(several, costs)].assign(role=SEVERAL))
        single = ["groups", "without_ms", "saved_ms"]
        tables[0] = costs.merge(removed[[*KEYS, *single]], on=KEYS, how="left")
    frames = joined(contributions)
    if len(frames):
        acting = _acting(frames, sensitivity, perturbation, threshold)
        tables[0] = tables[0].merge(acting, on=KEYS, how="left")
        tables.append(acting[_absent(acting, costs)])
    made = pd.concat(tables, ignore_index=True)
    order = made.groupby("scene", sort=False).ngroup().argsort(kind="stable")
    made = made.reindex(columns=effects_cost.column_names).iloc[order]
    return made.assign(role=made.role.mask(made.effect.isin([RIGHT, GLOBAL, REST]), PHASE))


def _absent(rows: pd.DataFrame, others: pd.DataFrame) -> np.ndarray:
    """Whether each of ``rows`` has a scene and effect that ``others`` have not."""
    keys, known = (pd.MultiIndex.from_frame(each[KEYS]) for each in (rows, others))
    return ~keys.isin(known)


def _acting(
    frames: pd.DataFrame, sensitivity: pd.DataFrame, perturbation: float, threshold: float
) -> pd.DataFrame:
    """Force and energy of each effect in ``frames``, and how far the run moves without it."""
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
