"""Columns of every table, in their fixed order."""

import pandas as pd

from pdrom.core.errors import StorageError

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
    "scaling": (
        "scene", "method", "threads", "vertices", "elements", "r", "k", "elements_sampled",
        "factorisation_ms", "memory_mb", "ms_per_iteration", "local_ms", "global_ms",
        "local_share", "speedup", "local_speedup",
    ),
    "scaling_fit": ("scene", "method", "threads", "quantity", "exponent", "points"),
    "stability": (
        "scene", "method", "r", "h", "stiffness_ratio", "finite", "blowup_frame", "max_extent",
        "energy_ratio", "gain", "group", "position_basis", "k", "experiment", "relative_error",
        "outcome", "guard_frame", "guard_reason", "guard_count",
    ),
    "guard": (
        "scene", "group", "method", "r", "action", "frames", "finite", "blowup_frame",
        "relative_error", "energy_ratio", "guard_frame", "guard_reason", "guard_count",
        "fallback_frames", "fallback_share", "ms_per_frame", "relative_cost",
    ),
    "hard_cases": (
        "case", "method", "k", "r", "gain", "frames", "finite", "blowup_frame", "max_extent",
        "objective_rise", "outcome", "why",
    ),
    "kernel_accuracy": (
        "group", "matrix_class", "cases", "condition", "worst_relative_error",
        "worst_over_condition",
    ),
    "budget": (
        "scene", "budget_ms", "reference", "method", "position_basis", "k", "r", "iterations",
        "relative_error_within_horizon", "ms_per_frame",
    ),
    "breakeven": (
        "scene", "group", "method", "factor", "vertices", "elements", "threads", "r", "local_ms",
        "full_ms", "ratio", "breakeven_r",
    ),
    "effects_cost": ("scene", "effect", "elements", "ms_per_frame", "share"),
    "effects_left_out": (
        "scene", "left_out", "groups", "elements", "ms_per_frame", "saved_ms", "own_ms",
    ),
    "targets": (
        "scene", "group", "method", "r", "error", "orthogonal_error", "ratio", "asked", "within",
        "gain", "elements_sampled", "elements_share", "spread",
    ),
    "gain_prediction": (
        "predictor", "lower", "upper", "runs", "failed", "failed_share", "median_error",
        "rank_correlation", "threshold", "misclassified_share", "failures_ordered",
    ),
    "online": (
        "scene", "vertices", "elements", "position_basis", "k", "tau", "elements_sampled",
        "relative_error_train", "relative_error_heldout", "ms_per_frame", "ms_per_iteration",
        "fom_ms_per_frame", "speedup",
    ),
    "subspace_ablation": (
        "scene", "group", "position_basis", "k", "r", "variant", "elements_sampled", "gain",
        "finite", "max_extent", "relative_error_within_horizon", "relative_error_full_projections",
        "heldout_error_within_horizon", "heldout_error_full_projections",
    ),
    "offline_cost": ("task", "implementation", "rows", "columns", "seconds", "difference"),
    "claims": (
        "claim", "source", "paper", "measured", "verdict", "why", "figure_or_table",
    ),
}  # fmt: skip

# What the sizes r of one line of the table breakeven have in common.
BREAKEVEN_CURVE = ["scene", "group", "method", "factor", "threads"]

# The only columns that may differ between two runs on one machine.
TIMING_COLUMNS: dict[str, tuple[str, ...]] = {
    "reduced_reruns": ("ms_per_frame", "local_ms", "global_ms", "speedup"),
    "accuracy_cost": ("ms_per_frame", "pareto"),
    "local_share": ("local_ms", "assembly_ms", "global_ms", "local_share"),
    "scaling": (
        "factorisation_ms", "memory_mb", "ms_per_iteration", "local_ms", "global_ms",
        "local_share", "speedup", "local_speedup",
    ),
    "scaling_fit": ("exponent",),
    "guard": ("ms_per_frame", "relative_cost"),
    "budget": (
        "method",
        "position_basis",
        "k",
        "r",
        "iterations",
        "relative_error_within_horizon",
        "ms_per_frame",
    ),
    "breakeven": ("local_ms", "full_ms", "ratio", "breakeven_r"),
    "effects_cost": ("ms_per_frame", "share"),
    "effects_left_out": ("ms_per_frame", "saved_ms", "own_ms"),
    "online": ("ms_per_frame", "ms_per_iteration", "fom_ms_per_frame", "speedup"),
    "offline_cost": ("seconds",),
    "claims": ("measured", "verdict", "why"),
}  # fmt: skip


def conform(table: pd.DataFrame, name: str) -> pd.DataFrame:
    """``table`` with exactly the columns of ``name``, in order; StorageError if one is missing."""
    missing = [column for column in COLUMNS[name] if column not in table.columns]
    if missing:
        raise StorageError(f"table {name}: lacks the column(s) {', '.join(missing)}")
    return table[list(COLUMNS[name])].reset_index(drop=True)
