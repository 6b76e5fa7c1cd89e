"""Table frame_times: the one time of each full-order run, to which all other tables refer."""

import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.experiments.kit.fresh_process import CONTROL, FULL
from study.tables.kit.declaration import flag, integer, number, table, timed
from study.tables.kit.intervals import confirmed, median_interval
from study.tables.kit.parts import joined
from study.tables.kit.reruns import TWIN
from study.tables.kit.vocabulary import MS_PER_FRAME, SCENE, VERTICES


@table(
    title="Times of full-order frames, with their controls",
    columns=(
        SCENE,
        VERTICES,
        integer("processes", "processes that timed it"),
        MS_PER_FRAME,
        timed(number("low_ms", "2.5 % quantile of this median (bootstrap)", "ms")),
        timed(number("high_ms", "97.5 % quantile", "ms")),
        timed(number("control_ratio", "time of the same run, timed once more, over this one")),
        timed(number("control_low", "2.5 % quantile of this median")),
        timed(number("control_high", "97.5 % quantile")),
        timed(flag("control_agrees", "the quantiles enclose one")),
        timed(number("twin_ratio", "time of the scene's twin, the same frames, over this one")),
        timed(number("twin_low", "2.5 % quantile of this median")),
        timed(number("twin_high", "97.5 % quantile")),
        timed(flag("confirmed", "the quantiles lie within a half of one: speed-ups are given")),
    ),
    reads={"parts": Every(paths.FRAME_TIMES)},
)
def frame_times(parts: list[File]) -> pd.DataFrame:
    """One row per scene of ``parts``: medians over processes, ratios within a process."""
    rows = joined(parts)
    if rows.empty:
        return rows
    full, control = (
        rows[rows.role == role].pivot(index="process", columns="scene", values="ms_per_frame")
        for role in (FULL, CONTROL)
    )
    vertices = rows.groupby("scene").vertices.first()
    made = []
    for scene in rows.scene.unique():
        row = {"scene": scene, "vertices": vertices[scene], "processes": len(full)}
        row |= _named(("ms_per_frame", "low_ms", "high_ms"), full[scene])
        row |= _named(_ratio("control"), control[scene] / full[scene])
        row["confirmed"] = confirmed(row["control_low"], row["control_high"])
        row["control_agrees"] = row["control_low"] <= 1.0 <= row["control_high"]
        if f"{scene}{TWIN}" in full:
            row |= _named(_ratio("twin"), full[f"{scene}{TWIN}"] / full[scene])
        made.append(row)
    return pd.DataFrame(made).reindex(columns=[c.name for c in frame_times.columns])


def _ratio(name: str) -> tuple[str, str, str]:
    return f"{name}_ratio", f"{name}_low", f"{name}_high"


def _named(names: tuple[str, str, str], values: pd.Series) -> dict:
    return dict(zip(names, median_interval(values.to_numpy(float)), strict=True))
