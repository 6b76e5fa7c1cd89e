"""Table scaling_fit: how time and memory grow with the number of vertices."""

import numpy as np
import pandas as pd

from study.artifact.reads import TableOf
from study.tables.kit.declaration import integer, number, table, text, timed
from study.tables.kit.vocabulary import METHOD, SCENE, THREADS

QUANTITIES = ("ms_per_iteration", "local_ms", "global_ms", "factorisation_ms", "memory_mb")
FEWEST = 3  # sizes


@table(
    title="Exponents of cost against the size of the mesh",
    columns=(
        SCENE,
        METHOD,
        THREADS,
        text("quantity", "column of the table scaling"),
        timed(number("exponent", "of the power law in the number of vertices")),
        timed(integer("points", "sizes of the mesh that it is fitted to")),
    ),
    reads={"scaling": TableOf("scaling")},
)
def scaling_fit(scaling: pd.DataFrame) -> pd.DataFrame:
    """Exponents of power laws in the number of vertices of ``scaling``, fitted to the logarithms.

    Any two points lie on a power law: a quantity with fewer than three sizes has no row, and one
    that was too small to be measured on so many has no exponent.
    """
    rows = []
    for labels, part in scaling.groupby(["scene", "method", "threads"], sort=False):
        for quantity in QUANTITIES:
            points = part[["vertices", quantity]].dropna()
            if points.vertices.nunique() < FEWEST:
                continue
            points = points[points[quantity] > 0.0].astype(float)
            row = dict(zip(("scene", "method", "threads"), labels, strict=True))
            row |= {"quantity": quantity, "exponent": None, "points": len(points)}
            if points.vertices.nunique() >= FEWEST:
                slope, _ = np.polyfit(np.log(points.vertices), np.log(points[quantity]), 1)
                row["exponent"] = slope
            rows.append(row)
    return pd.DataFrame(rows)
