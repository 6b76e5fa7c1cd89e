"""Tables of the cost of a full-order run: by effect, by local step, and by size of the mesh."""

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every, Setting, TableOf
from study.experiments.kit.base import FOM, GLOBAL, REST, RIGHT, Horizon, floor_of, horizons
from study.experiments.sensitivity import without
from study.tables.kit.declaration import flag, integer, number, shared, table, text, timed
from study.tables.kit.results import in_one_time, joined, timings_in_one_time

KEYS = ["scene", "effect"]
NOTHING = "nothing"  # value of the column effect for the whole scene, with no effect left out
PHASE, SEVERAL = "phase", "several"
IMPLEMENTATIONS = ("interpreted", "numpy", "compiled")
EXPONENTS = {"ms_per_iteration": "exponent", "local_ms": "local_exponent",
             "global_ms": "global_exponent"}  # fmt: skip
FEWEST = 3  # least number of meshes for the fit of an exponent


@table(
    title="Cost and contribution of each effect in a full-order run",
    columns=(
        *shared("scene"),
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
        *shared("ms_per_frame"),
        timed(number("share", "of the frame; those of a scene add up to one")),
        integer("groups", "constraint groups of the scene that is built without it"),
        timed(number("without_ms", "time of a frame of the scene that is built without it", "ms")),
        timed(number("saved_ms", "time of the whole scene less that", "ms")),
        number("force", "root mean square over the frames of the norm of its force", "N"),
        number("force_share", "of the sum over the effects of the scene"),
        integer("acting_frames", "frames in which it exerts a force at all", compared="error"),
        number("energy", "range of the energy that it holds, where it has one", "J"),
        number(
            "moved",
            "how far the run moves without it: largest drift before the horizon",
            compared="error",
        ),
        *shared("sensitivity_floor"),
        flag("above_floor", "moved is larger than the sensitivity floor", compared="error"),
    ),
    reads={
        "parts": Every(paths.EFFECTS),
        "left_out": Every(paths.LEFT_OUT),
        "contributions": Every(paths.CONTRIBUTIONS),
        "frame_times": TableOf("frame_times"),
        "sensitivity": TableOf("sensitivity"),
        "horizon": Setting("horizon"),
    },
)
def effects_cost(
    frame_times: pd.DataFrame, sensitivity: pd.DataFrame, horizon: Horizon, **files: list[File]
) -> pd.DataFrame:
    """One row per effect or phase of a scene, then one per set of effects left out together.

    Parameters
    ----------
    parts, left_out : times of effects, and of scenes without some of them; they are scaled to the
        full-order times in ``frame_times`` by `in_one_time`
    contributions : forces and energies by frame
    sensitivity, horizon : arguments of `horizons`, the end of each scene's comparable frames;
        ``moved`` is empty for the only group of a scene, which cannot be left out
    """
    costs, removed = joined(files["parts"]), joined(files["left_out"])
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
    frames = joined(files["contributions"])
    if len(frames):
        acting = _acting(frames, sensitivity, horizon)
        tables[0] = tables[0].merge(acting, on=KEYS, how="left")
        tables.append(acting[_absent(acting, costs)])
    made = pd.concat(tables, ignore_index=True)
    order = made.groupby("scene", sort=False).ngroup().argsort(kind="stable")
    made = made.reindex(columns=effects_cost.column_names).iloc[order]
    return made.assign(role=made.role.mask(made.effect.isin([RIGHT, GLOBAL, REST]), PHASE))


def _absent(rows: pd.DataFrame, others: pd.DataFrame) -> np.ndarray:
    """Boolean array: whether ``others`` lacks the scene and effect of each of ``rows``."""
    keys, known = (pd.MultiIndex.from_frame(each[KEYS]) for each in (rows, others))
    return ~keys.isin(known)


def _acting(frames: pd.DataFrame, sensitivity: pd.DataFrame, horizon: Horizon) -> pd.DataFrame:
    """Force and energy of each effect in ``frames``, and drift of the run without this effect."""
    made = frames.groupby([*KEYS, "role"], sort=False, as_index=False).agg(
        force=("force", lambda force: float(np.sqrt(np.mean(np.square(force))))),
        acting_frames=("force", lambda force: int((force > 0.0).sum())),
        energy=("energy", lambda of: float(of.max() - of.min() if len(of) > 1 else of.iloc[0])),
    )
    length = frames.groupby("scene").frame.max() + 1
    # an effect with role "start" has a row in the first frame only; take the RMS over all frames
    starts = made.role == "start"
    made.loc[starts, "force"] /= np.sqrt(made.scene[starts].map(length).to_numpy(float))
    made["force_share"] = made.force / made.groupby("scene").force.transform("sum")
    ends = horizons(sensitivity, horizon.perturbation, horizon.threshold)

    def largest(scene: str, label: float | str) -> float | None:
        """Largest drift of run ``label`` before the horizon; None without such a run or frame."""
        drift = floor_of(sensitivity, scene, label)[: ends[scene]]
        return float(drift.max()) if len(drift) else None

    made["sensitivity_floor"] = [largest(scene, horizon.perturbation) for scene in made.scene]
    made["moved"] = [largest(row.scene, without(row.effect)) for row in made.itertuples()]
    judged = made.moved.notna()
    made["above_floor"] = (made.moved > made.sensitivity_floor).where(judged, None).astype(object)
    return made


@table(
    title="Share of the local step in a full-order frame",
    columns=(
        *shared("scene"),
        text("implementation", f"of the local step: {', '.join(IMPLEMENTATIONS)}"),
        *shared("vertices local_ms"),
        timed(number("assembly_ms", "time of the right-hand side in a frame", "ms")),
        *shared("global_ms local_share"),
    ),
    reads={"timings": Every(paths.TIMINGS), "frame_times": TableOf("frame_times")},
)
def local_share(timings: list[File], frame_times: pd.DataFrame) -> pd.DataFrame:
    """One row per scene and implementation, with ``timings`` scaled to the table ``frame_times``.

    Assembly is added to the local step, as compiled kernels project and scatter in one pass.
    """
    times = timings_in_one_time(timings, frame_times)
    full = times[times.method.isna()].copy()
    full["local_share"] = (full.local_ms + full.assembly_ms) / (
        full.local_ms + full.assembly_ms + full.global_ms
    )
    order = {name: place for place, name in enumerate(IMPLEMENTATIONS)}
    scenes = {scene: place for place, scene in enumerate(times.scene.unique())}
    keys = full.scene.map(scenes) * len(order) + full.implementation.map(order)
    return full.iloc[keys.argsort(kind="stable")]


@table(
    title="Cost of an iteration against the size of the mesh",
    columns=(
        *shared("scene"),
        text("method", f"{FOM} (full order), a reduced local step, or ecsw"),
        *shared("vertices"),
        integer("elements", "elements of all groups"),
        *shared("r k elements_sampled"),
        timed(number("factorisation_ms", "assembly and factorisation of the system", "ms")),
        timed(number("memory_mb", "memory that both took", "MB")),
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        timed(number("local_ms", "time of the local step in an iteration", "ms")),
        timed(number("global_ms", "time of the global solve in an iteration", "ms")),
        *shared("vertices_ms local_share speedup"),
        timed(number("local_speedup", "the same of the local step alone")),
        integer("meshes", "sizes of the mesh of the curve"),
        timed(number("exponent", "of the time of an iteration in the number of vertices")),
        timed(number("local_exponent", "of the time of the local step")),
        timed(number("global_exponent", "of the time of the global solve")),
    ),
    reads={"parts": Every(paths.SCALING)},
)
def scaling(parts: list[File]) -> pd.DataFrame:
    """One row per scene, mesh size and method, from the files ``parts`` of all scenes.

    Speed-ups of an iteration and of its local step are relative to the full-order run. Exponents
    belong to power laws, fitted in logarithms over all meshes of a scene and method and repeated in
    each of these rows. An exponent is empty if fewer than three meshes have a measurable time, as
    any two points lie on a power law.
    """
    rows = joined(parts)
    if rows.empty:
        return rows
    own = rows[rows.method == FOM].set_index(["scene", "vertices"])
    mesh = pd.MultiIndex.from_frame(rows[["scene", "vertices"]])
    for name, column in (("speedup", "ms_per_iteration"), ("local_speedup", "local_ms")):
        rows[name] = own[column].loc[mesh].to_numpy() / rows[column]
    curves = rows.groupby(["scene", "method"], sort=False)
    rows["meshes"] = curves.vertices.transform("nunique")
    for quantity, name in EXPONENTS.items():
        rows[name] = np.nan
        for _, curve in curves:
            measured = curve[curve[quantity] > 0.0]
            if measured.vertices.nunique() >= FEWEST:
                x, y = np.log(measured[["vertices", quantity]].to_numpy(float)).T
                rows.loc[curve.index, name] = float(np.polyfit(x, y, 1)[0])
    return rows
