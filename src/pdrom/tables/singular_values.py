"""Table singular_values: decay of the centred training snapshots of each group."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from pdrom.reduction.basis import load_basis
from pdrom.tables.columns import conform


def singular_values(bases: Iterable[str]) -> pd.DataFrame:
    """Rows of all bases, given as paths ``.../{scene}/{group}/{basis}.h5`` in order."""
    parts = []
    for path in bases:
        basis = load_basis(path)
        sigma = basis.singular_values
        parts.append(
            pd.DataFrame(
                {
                    "scene": Path(path).parent.parent.name,
                    "group": Path(path).parent.name,
                    "component": range(1, len(sigma) + 1),
                    "singular_value": sigma,
                    "relative": sigma / sigma[0] if sigma[0] > 0.0 else float("nan"),
                    "above_roundoff": [i < basis.rank for i in range(len(sigma))],
                }
            )
        )
    return conform(pd.concat(parts, ignore_index=True), "singular_values")
