"""Tables of errors: of reconstructions, perturbed runs, and single choices of the method."""

from dataclasses import replace

import pandas as pd

from pdrom.reduction.basis import load_basis
from study.artifact import paths
from study.artifact.reads import EachOf, Every
from study.tables.kit.declaration import flag, integer, number, shared, table, text
from study.tables.kit.results import joined

_SMALL = "empty at round-off level"
_CELL = ["scene", "group", "method", "r", "varied"]


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
def singular_values(bases: list[paths.File]) -> pd.DataFrame:
    """One row per mode of each of the ``bases``, in the order of the files."""
    parts = []
    for file in bases:
        basis = load_basis(file.path)
        sigma = basis.singular_values
        modes = pd.DataFrame({"component": range(1, len(sigma) + 1), "singular_value": sigma})
        modes["relative"] = sigma / sigma[0] if sigma[0] > 0.0 else float("nan")
        modes["above_roundoff"] = modes.component <= basis.rank
        parts.append(modes.assign(scene=file["scene"], group=file["group"]))
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
def reconstruction_error(parts: list[paths.File]) -> pd.DataFrame:
    """Rows of the files ``parts`` of all methods, in order."""
    return joined(parts)


@table(
    title="Drift of perturbed full-order runs",
    columns=(
        *shared("scene"),
        text("perturbation", "of the start, over the extent; or what else was changed"),
        integer("frame", "number of the frame, from 0"),
        number("relative_difference", "largest over the seeds", compared="error"),
    ),
    reads={"parts": Every(paths.SENSITIVITY)},
)
def sensitivity(parts: list[paths.File]) -> pd.DataFrame:
    """Largest difference in ``parts`` over the seeds, per scene, perturbation and frame."""
    keys = ["scene", "perturbation", "frame"]
    rows = joined(parts).groupby(keys, sort=False, as_index=False)
    return rows["relative_difference"].max()


@table(
    title="Runs on bases of round-off",
    columns=(
        *shared("scene group"),
        text(
            "noisy_axes",
            "what the start's round-off reaches: all axes; of a flat mesh its plane, or this and "
            "the axis across it at one vertex",
        ),
        integer("seed", "of the start's round-off"),
        *shared("method r"),
        integer("rank", "modes that the snapshots have without a cutoff", compared="value"),
        # the gain has no reproducible value because the modes are made of round-off
        replace(*shared("gain"), compared="skipped"),
        *shared("frames finite blowup_frame"),
        number(
            "relative_error", "error of the positions over all frames, which end at the horizon"
        ),
    ),
    reads={"parts": Every(paths.NOISE)},
)
def noise(parts: list[paths.File]) -> pd.DataFrame:
    """Rows of the files ``parts`` of all scenes, in order."""
    return joined(parts)


@table(
    title="Repeated runs: other training frames, moved starts",
    columns=(
        *shared("scene group method r"),
        text("varied", "what differs: training (frames), start"),
        integer("repetitions", "runs; their range encloses the median of all but by 2^(1 - n)"),
        integer(
            "ended", "runs that ended before the horizon, with an infinite error", compared="error"
        ),
        number("error_median", "median of the errors of the positions before the horizon"),
        number("error_low", "the least of them"),
        number("error_high", "the largest"),
        number("gain_median", "median of the gains"),
        number("gain_low", "the least of them"),
        number("gain_high", "the largest"),
        number("spread", "largest error over least", compared="error"),
    ),
    reads={"parts": Every(paths.REPETITIONS)},
)
def repetitions(parts: list[paths.File]) -> pd.DataFrame:
    """One row per scene, group, method, r and variation, with statistics over its repetitions.

    The median of a distribution lies outside the range of n independent draws with probability
    2^(1 - n): five draws enclose it with probability 15/16, whatever the distribution is.
    """
    rows = joined(parts)
    if rows.empty:
        return rows
    cells = rows.groupby(_CELL, sort=False)
    made = cells.agg(
        repetitions=("error", "size"),
        error_median=("error", "median"),
        error_low=("error", "min"),
        error_high=("error", "max"),
        gain_median=("gain", "median"),
        gain_low=("gain", "min"),
        gain_high=("gain", "max"),
    )
    made["ended"] = rows.error.isin([float("inf")]).groupby([rows[c] for c in _CELL]).sum()
    return made.assign(spread=made.error_high / made.error_low).reset_index()


@table(
    title="From the published choices to sound ones, one at a time",
    columns=(
        *shared("scene group"),
        text(
            "direction",
            "up from published choices, down from sound ones, signs of the modes, square: "
            "coefficients by samples",
        ),
        text("rung", "choice that changes on this rung"),
        integer("rows_per_element", "rows of an element"),
        integer("entries", "sampled entries that determine the coefficients", compared="value"),
        *shared("r"),
        number("condition", "condition number of the sampled modes"),
        *shared("gain"),
        number("error_train", "reconstruction error of the training snapshots"),
        number("error_test", "the same of the snapshots between them"),
        number("error_heldout", "the same of the held-out motion"),
        *shared("finite blowup_frame relative_error_within_horizon"),
        integer("repetitions", "runs trained on other frames, where they were repeated"),
        number("error_median", "median of their errors before the horizon"),
        number("error_low", "the least of them"),
        number("error_high", "the largest; inf for a run that ended earlier"),
        number("gain_low", "the least of their gains"),
        number("gain_high", "the largest"),
    ),
    reads={"parts": Every(paths.LADDER)},
)
def ladder(parts: list[paths.File]) -> pd.DataFrame:
    """Rows of the files ``parts`` of all scenes, in order."""
    return joined(parts)
