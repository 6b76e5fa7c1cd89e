"""Table scaling: time and memory against the number of vertices."""

import pandas as pd

from pdrom.core.store import read_table
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import Every
from study.experiments.kit.names import FOM
from study.tables.kit.declaration import integer, number, table, text, timed
from study.tables.kit.vocabulary import (
    ELEMENTS_SAMPLED,
    LOCAL_SHARE,
    SCENE,
    SPEEDUP,
    THREADS,
    VERTICES,
    K,
    R,
)


@table(
    title="Cost of an iteration against the size of the mesh",
    columns=(
        SCENE,
        text("method", f"{FOM} (full order), a reduced local step, or ecsw"),
        THREADS,
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
    ),
    reads={"parts": Every(paths.SCALING)},
)
def scaling(parts: list[File]) -> pd.DataFrame:
    """All scenes of ``parts``, one row per mesh size and method.

    The speed-ups, of an iteration and of its local step, are over the full-order run on one thread.
    """
    sizes = [_with_speedups(read_table(part.path)) for part in parts]
    return pd.concat(sizes, ignore_index=True) if sizes else pd.DataFrame()


def _with_speedups(part: pd.DataFrame) -> pd.DataFrame:
    (own,) = part[(part.method == FOM) & (part.threads == 1)].itertuples()
    return part.assign(
        speedup=own.ms_per_iteration / part.ms_per_iteration,
        local_speedup=own.local_ms / part.local_ms,
    )
