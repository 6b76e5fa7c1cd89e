"""Tables of the singular values of snapshots and of the reconstruction errors of all methods."""

import pandas as pd

from pdrom.reduction.basis import load_basis
from study.artifact import paths
from study.artifact.paths import File
from study.artifact.reads import EachOf, Every
from study.tables.kit.declaration import flag, integer, number, table, text
from study.tables.kit.parts import joined
from study.tables.kit.vocabulary import shared

_SMALL = "empty at round-off level"


@table(
    title="Singular values of the training snapshots",
    columns=(
        *shared("scene group"),
        integer("component", "number of the mode, from 1"),
        number("singular_value", "of the snapshot matrix", "that of the group's projections"),
        number("relative", "over the first one"),
        flag("above_roundoff", "larger than the rounding errors of the projections"),
    ),
    # the basis without weights and centring; which other bases exist depends on the configuration
    reads={"bases": EachOf(paths.BASIS, "usual_bases")},
)
def singular_values(bases: list[File]) -> pd.DataFrame:
    """One row per mode of each of the ``bases``, in the order of the files."""
    parts = []
    for file in bases:
        basis = load_basis(file.path)
        sigma = basis.singular_values
        parts.append(
            pd.DataFrame(
                {
                    "scene": file["scene"],
                    "group": file["group"],
                    "component": range(1, len(sigma) + 1),
                    "singular_value": sigma,
                    "relative": sigma / sigma[0] if sigma[0] > 0.0 else float("nan"),
                    "above_roundoff": [i < basis.rank for i in range(len(sigma))],
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


@table(
    title="Reconstruction error of every method and size",
    columns=(
        *shared("scene group method r"),
        text("split", "snapshots that are reconstructed: train, test, heldout"),
        number("relative_error", f"of the projections; {_SMALL}"),
        number("relative_error_x", f"of their x-coordinates; {_SMALL}"),
        number("relative_error_y", f"of their y-coordinates; {_SMALL}"),
        number("relative_error_z", f"of their z-coordinates; {_SMALL}"),
        *shared("gain"),
        integer("rows_sampled", "rows of the projections that are evaluated", compared="value"),
        *shared("elements_sampled"),
    ),
    reads={"parts": Every(paths.RECONSTRUCTION)},
)
def reconstruction_error(parts: list[File]) -> pd.DataFrame:
    """Rows of the files ``parts`` of all methods, in order."""
    return joined(parts)
