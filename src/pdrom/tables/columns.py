"""Columns of every table, in their fixed order."""

import pandas as pd

from pdrom.errors import StorageError

COLUMNS: dict[str, tuple[str, ...]] = {
    "singular_values": (
        "scene", "group", "component", "singular_value", "relative", "above_roundoff",
    ),
    "reconstruction_error": (
        "scene", "group", "method", "r", "split", "relative_error", "relative_error_x",
        "relative_error_y", "relative_error_z", "gain", "rows_sampled", "elements_sampled",
    ),
    "reduced_reruns": (
        "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
        "max_extent", "relative_error", "relative_error_within_horizon", "horizon_frame",
        "sensitivity_floor", "ms_per_frame", "local_ms", "global_ms", "speedup",
    ),
    "heldout_reruns": (
        "scene", "group", "method", "position_basis", "k", "r", "frames", "finite", "blowup_frame",
        "max_extent", "relative_error", "relative_error_within_horizon", "horizon_frame",
        "sensitivity_floor",
    ),
    "accuracy_cost": (
        "scene", "method", "position_basis", "k", "r", "iterations",
        "relative_error_within_horizon", "ms_per_frame", "pareto",
    ),
    "local_share": (
        "scene", "implementation", "vertices", "local_ms", "assembly_ms", "global_ms",
        "local_share",
    ),
    "sensitivity": ("scene", "perturbation", "frame", "relative_difference"),
    "ladder": (
        "scene", "group", "direction", "rung", "r", "condition", "gain", "error_train",
        "error_test", "error_heldout", "finite", "blowup_frame", "relative_error_within_horizon",
    ),
    "subspace_ablation": (
        "scene", "group", "position_basis", "k", "r", "variant", "elements_sampled", "gain",
        "finite", "max_extent", "relative_error_within_horizon", "relative_error_full_projections",
        "heldout_error_within_horizon", "heldout_error_full_projections",
    ),
    "claims": (
        "claim", "source", "paper", "measured", "verdict", "why", "figure_or_table",
    ),
}  # fmt: skip

# The only columns that may differ between two runs on one machine.
TIMING_COLUMNS: dict[str, tuple[str, ...]] = {
    "reduced_reruns": ("ms_per_frame", "local_ms", "global_ms", "speedup"),
    "accuracy_cost": ("ms_per_frame", "pareto"),
    "local_share": ("local_ms", "assembly_ms", "global_ms", "local_share"),
    "claims": ("measured", "verdict", "why"),
}


def conform(table: pd.DataFrame, name: str) -> pd.DataFrame:
    """``table`` with exactly the columns of ``name``, in order; StorageError if one is missing."""
    missing = [column for column in COLUMNS[name] if column not in table.columns]
    if missing:
        raise StorageError(f"table {name}: lacks the column(s) {', '.join(missing)}")
    return table[list(COLUMNS[name])].reset_index(drop=True)
