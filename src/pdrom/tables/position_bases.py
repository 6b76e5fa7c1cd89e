"""Table position_bases: what a position subspace could hold, beside what its run leaves."""

import pandas as pd

from pdrom.artifact.reads import Every
from pdrom.core import paths
from pdrom.core.paths import File
from pdrom.model.held_out import MOTIONS
from pdrom.tables.kit.declaration import compared, flag, number, table, text
from pdrom.tables.kit.parts import joined
from pdrom.tables.kit.vocabulary import ERROR_WITHIN, POSITION_BASIS, SCENE, K

_PAIR = ["scene", "split", "k"]


@table(
    title="Position subspaces: best approximation and run",
    columns=(
        SCENE,
        text("split", f"motion: train, {', '.join(MOTIONS)}"),
        POSITION_BASIS,
        K,
        compared(
            "error",
            number(
                "best_approximation",
                "error of the best positions in the subspace, before the horizon",
            ),
        ),
        ERROR_WITHIN,
        # both errors may be round-off
        compared(
            "error",
            number("ratio", "the error of the run with full projections over the best one"),
        ),
        compared(
            "error",
            flag(
                "loses", "of a snapshot basis: its run has a larger error than the skinning basis'"
            ),
        ),
        flag("best_loses", "of a snapshot basis: its best approximation is worse than the other's"),
        compared(
            "error",
            number(
                "full_order_out_of_plane", "of a flat rest shape: share of the motion normal to it"
            ),
        ),
        compared("error", number("out_of_plane", "the same of the run")),
    ),
    reads={"parts": Every(paths.POSITION_BASES)},
)
def position_bases(parts: list[File]) -> pd.DataFrame:
    """One row of ``parts`` per motion, kind of basis and size; ``loses`` where both have a run."""
    rows = joined(parts)
    if rows.empty:
        return rows
    error = rows.relative_error_within_horizon.astype(float)
    best = rows.best_approximation.astype(float)
    rows["ratio"] = error / best.where(best > 0.0)
    other = rows[rows.position_basis == "skinning"].set_index(_PAIR)
    keys = pd.MultiIndex.from_frame(rows[_PAIR])
    snapshots = rows.position_basis == "pod"
    for flag_name, own in (
        ("loses", "relative_error_within_horizon"),
        ("best_loses", "best_approximation"),
    ):
        against = other[own].astype(float).reindex(keys).to_numpy()
        known = snapshots & ~pd.isna(against) & rows[own].notna()
        rows[flag_name] = (rows[own].astype(float) > against).where(known)
    return rows
