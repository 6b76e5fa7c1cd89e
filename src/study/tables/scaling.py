"""Table scaling: time and memory against the number of vertices."""

import numpy as np
import pandas as pd

from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.experiments.kit.names import FOM
from study.tables.kit.declaration import integer, number, table, text, timed
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import (
    ELEMENTS_SAMPLED,
    LOCAL_SHARE,
    SCENE,
    SPEEDUP,
    VERTICES,
    K,
    R,
)

EXPONENTS = {"ms_per_iteration": "exponent", "local_ms": "local_exponent",
             "global_ms": "global_exponent"}  # fmt: skip
FEWEST = 3  # meshes, for an exponent


@table(
    title="Cost of an iteration against the size of the mesh",
    columns=(
        SCENE,
        text("method", f"{FOM} (full order), a reduced local step, or ecsw"),
        VERTICES,
        integer("elements", "elements of all groups"),
        R,
        K,
        ELEMENTS_SAMPLED,
        timed(number("factorisation_ms", "assembly and factorisation of the system", "ms")),
        timed(number("memory_mb", "memory that both took", "MB")),
        timed(number("ms_per_iteration", "time of an iteration", "ms")),
        timed(number("local_ms", "time of the local step in an iteration", "ms")),
        timed(number("global_ms", "time of the global solve in an iteration", "ms")),
        LOCAL_SHARE,
        SPEEDUP,
        timed(number("local_speedup", "the same of the local step alone")),
        integer("meshes", "sizes of the mesh of the curve"),
        timed(number("exponent", "of the time of an iteration in the number of vertices")),
        timed(number("local_exponent", "of the time of the local step")),
        timed(number("global_exponent", "of the time of the global solve")),
    ),
    reads={"parts": Every(paths.SCALING)},
)
def scaling(parts: list[File]) -> pd.DataFrame:
    """All scenes of ``parts``, one row per mesh size and method.

    The speed-ups, of an iteration and of its local step, are over the full-order run. Exponents are
    those of power laws fitted to the logarithms of a curve, all meshes of a scene and method, which
    has them in all its rows. Any two points lie on a power law: a curve of fewer than three meshes
    has no exponent, and no quantity that was too small to be measured on so many.
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
            rows.loc[curve.index, name] = _exponent(curve.vertices, curve[quantity])
    return rows


def _exponent(vertices: pd.Series, values: pd.Series) -> float:
    """Slope of the logarithms of what was measured; nan of fewer than three meshes."""
    measured = values > 0.0
    if vertices[measured].nunique() < FEWEST:
        return np.nan
    x, y = (np.log(series[measured].to_numpy(float)) for series in (vertices, values))
    return float(np.polyfit(x, y, 1)[0])
