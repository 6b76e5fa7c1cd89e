"""Tables of errors: of reconstructions, of perturbed runs, and of runs with one changed choice.

The gain is the factor by which sampling amplifies errors. Table gain_interventions shows whether
the error of a run falls if only its gain is lowered: each step compares two methods with one basis
and size r that differ in their samples, or in whether the axes x, y and z share coefficients. If
separate coefficients raise errors only by their gain, errors must also fall with the gain between
methods that all have separate, or all shared ones (`KINDS`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np
import pandas as pd

from pdrom.reduction.basis import load_basis
from study.artifact import paths
from study.artifact.reads import EachOf, TableOf
from study.tables.kit import declaration, results
from study.tables.kit.declaration import count, flag, integer, number, shared, table, text
from study.tables.kit.results import Rows

_SMALL = "empty at round-off level"
# Errors of approximations amplify rounding errors less than runs do, 7e-4 at most was measured.
_approximation = partial(number, compared="value", tolerance=0.005)
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
    # each group's `USUAL_BASIS` (no weights, not centred) if the study makes it, else its first one
    reads={"bases": EachOf(paths.BASIS, "usual_bases")},
)
def singular_values(bases: list[paths.File]) -> pd.DataFrame:
    """One row for each mode of each POD basis, in the order of the files ``bases``."""
    parts = []
    for file in bases:
        basis = load_basis(file.path)
        sigma, component = basis.singular_values, np.arange(1, len(basis.singular_values) + 1)
        modes = pd.DataFrame({"component": component, "singular_value": sigma, **file.labels})
        relative = sigma / sigma[0] if sigma[0] > 0.0 else np.nan
        parts.append(modes.assign(relative=relative, above_roundoff=component <= basis.rank))
    return pd.concat(parts, ignore_index=True)


@table(
    title="Reconstruction error of every method and size",
    columns=(
        *shared("scene group method r"),
        text("split", "snapshots that are reconstructed: train, test, heldout"),
        _approximation("relative_error", f"of the projections; {_SMALL}"),
        *(_approximation(f"relative_error_{a}", f"of {a}-coordinates; {_SMALL}") for a in "xyz"),
        *shared("gain"),
        integer("rows_sampled", "rows of the projections that are evaluated", compared="value"),
        *shared("elements_sampled"),
    ),
    reads={"rows": Rows(paths.RECONSTRUCTION)},
)
def reconstruction_error(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ``rows`` of all scenes, groups and methods."""
    return rows


@table(
    title="Drift of perturbed full-order runs",
    columns=(
        *shared("scene"),
        text("perturbation", "of the start, over the extent; or what else was changed"),
        integer("frame", "number of the frame, from 0"),
        number("relative_difference", "largest over the seeds", compared="error"),
    ),
    reads={"rows": Rows(paths.SENSITIVITY)},
)
def sensitivity(rows: pd.DataFrame) -> pd.DataFrame:
    """Relative difference of perturbed and unperturbed runs: largest over seeds, for each frame."""
    frames = rows.groupby(["scene", "perturbation", "frame"], sort=False, as_index=False)
    return frames.relative_difference.max()


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
        # modes made of round-off, and thus their gain (error amplification), depend on the machine
        replace(*shared("gain"), compared="skipped"),
        *shared("frames finite blowup_frame reference"),
        number("relative_error", "error of the positions over all frames up to the horizon"),
    ),
    reads={"rows": Rows(paths.NOISE)},
)
def noise(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ``rows`` of all scenes and groups: runs with bases made of round-off."""
    return rows.assign(reference=declaration.ITERATIONS)


@table(
    title="Repeated runs: other training frames, moved starts",
    columns=(
        *shared("scene group method r"),
        text("varied", "training (frames), start; held-out motions, with the number trained on"),
        integer("repetitions", "runs; their range encloses the median of all but by 2^(1 - n)"),
        integer("ended", "runs that ended early, with an infinite error", compared="error"),
        *shared("reference"),
        number("error_median", "median of the errors of the positions before the horizon"),
        *declaration.extremes("error"),
        number("gain_median", "median of the gains"),
        *declaration.extremes("gain"),
        number("spread", "largest error over least", compared="error"),
    ),
    reads={"rows": Rows(paths.REPETITIONS)},
)
def repetitions(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene, group, method, r and ``varied``: in what repeated runs differ."""
    cells = rows.assign(infinite=np.isinf(rows.error)).groupby(_CELL, sort=False)
    ends = {"median": "median", "low": "min", "high": "max"}
    found = {f"{n}_{end}": (n, how) for n in ("error", "gain") for end, how in ends.items()}
    made = cells.agg(repetitions=("error", "size"), ended=("infinite", "sum"), **found)
    spread = made.error_high / made.error_low
    return made.assign(spread=spread, reference=declaration.ITERATIONS).reset_index()


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
        number("error_heldout", "the same of the held-out motion"),
        *shared("finite blowup_frame reference relative_error_within_horizon"),
        integer("repetitions", "runs trained on other frames, where they were repeated"),
        number("error_median", "median of their errors; inf for a run that ended early"),
        *declaration.extremes("error"),
        *declaration.extremes("gain"),
    ),
    reads={"rows": Rows(paths.LADDER)},
)
def ladder(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ``rows`` of all scenes and groups."""
    return rows.assign(reference=declaration.ITERATIONS)


# Step that changes samples, in table gain_interventions -> (method before it, method after it).
STEPS = {
    "whole elements for single entries": ("deim", "block-deim"),
    "three elements a mode for one": ("block-deim", "gappy"),
}
# Change -> methods of table ladder before and after it: shared coefficients for x, y and z, or more
# samples (whole elements are compared with single rows only if elements have several rows).
_SAMPLES = "single rows", "whole elements", "three elements"
SQUARE = {
    **{f"shared coefficients, {own}": (f"{own}, separate", f"{own}, shared") for own in _SAMPLES},
    **{
        f"{after}, {kind} coefficients": (f"{before}, {kind}", f"{after}, {kind}")
        for before, after in (_SAMPLES[1:], _SAMPLES[:2])
        for kind in ("separate", "shared")
    },
}
# Step -> methods; of any two, that with the larger error amplification (gain) is "before" the step.
KINDS = {
    "lower gain, shared coefficients": ("deim", "block-deim", "gappy"),
    "lower gain, separate coefficients": ("deim-joint", "published"),
}
_PLACE = ["scene", "group", "r"]
VOLUMES = ("deformation_gradient", "tetrahedron_strain", "volume")  # groups on tetrahedra
MESHES = "all", "sheets", "bars"
# Constructs a column of numbers that summarise many runs, with the tolerance of "share" columns.
share = partial(number, compared="share")


@table(
    title="What the error does when the gain is lowered and the basis stays",
    columns=(
        text("step", f"one of: {', '.join([*STEPS, *SQUARE, *KINDS])}"),
        text("mesh", f"meshes of the pairs: {', '.join(MESHES)}"),
        text("method_before", "method before the step"),
        text("method_after", "method after it, on the same basis"),
        count("pairs", "scenes, groups and sizes at which both methods ran"),
        count("scenes", "scenes among them"),
        count("failing", "pairs whose error before exceeds a tenth"),
        count("rescued", "pairs among these whose error after does not"),
        count("failing_after", "pairs whose error after exceeds a tenth"),
        share("error_before", "median of the error before; inf for a run that ended early"),
        share("error_after", "median of the error after"),
        *shared("reference"),
        share("gain_ratio", "median of the gain after over that before"),
        share("error_ratio", "median of the error of the run after over that before"),
        *declaration.interval("error_ratio_low error_ratio_high", share),
        share("p_value", "two-sided sign test over all families, for which a tie is no fall"),
        count("families", "families among the scenes: a scene and its twin"),
        count("families_fallen", "those whose median error ratio is below one"),
        share("unexplained_share", "pairs of which one falls, the other not"),
    ),
    reads={
        "reruns": TableOf("reduced_reruns"),
        "reconstruction": TableOf("reconstruction_error"),
        "ladder": TableOf("ladder"),
    },
)
def gain_interventions(
    reruns: pd.DataFrame, reconstruction: pd.DataFrame, ladder: pd.DataFrame
) -> pd.DataFrame:
    """One row for each step (change of method that lowers the gain) and kind of mesh.

    A scene and its variant ("twin") are a family: the bootstrap resamples families, the sign test
    counts them. Errors below the sensitivity floor are raised to it. A run that ended early has an
    infinite error; two such runs are not compared.
    """
    runs = results.judged_runs(reruns, reconstruction)
    rows = []
    square = _square(ladder, runs) if len(ladder) else runs[:0].assign(rows_per_element=1)
    for *names, pairs in _steps(runs, square):
        volumes = pairs.group.isin(VOLUMES)
        for mesh, own in zip(MESHES, (pairs, pairs[~volumes], pairs[volumes]), strict=True):
            if len(own):
                labels = zip(("step", "method_before", "method_after"), names, strict=True)
                rows.append({**dict(labels), "mesh": mesh, **_summary(own)})
    return pd.DataFrame(rows).assign(reference=declaration.ITERATIONS)


def _steps(
    runs: pd.DataFrame, square: pd.DataFrame
) -> Iterator[tuple[str, str, str, pd.DataFrame]]:
    """Yield each change of method: name, both methods, run pairs; ``square``: from `_square`."""
    for name, methods in STEPS.items():
        yield name, *methods, _pairs(runs, *methods)
    several = square[square.rows_per_element > 1]
    for name, methods in SQUARE.items():
        chosen = several if name.startswith("whole elements") else square
        yield name, *methods, _pairs(chosen, *methods)
    for name, kind in KINDS.items():
        pairs = pd.concat([_pairs(runs, *two) for two in combinations(kind, 2)])
        ratios = pairs[["gain", "error"]]
        pairs[["gain", "error"]] = ratios.where(pairs.gain <= 1.0, 1.0 / ratios, axis=0)
        yield name, "the larger gain", "the smaller gain", pairs[pairs.gain < 1.0]


def _square(ladder: pd.DataFrame, runs: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``ladder`` with direction "square" and with a scene, group and r of ``runs``."""
    chosen = ladder[(ladder.direction == "square") & ladder.gain.notna()]
    chosen = chosen.rename(columns={"rung": "method"})
    error = chosen[results.ERROR].astype(float).fillna(np.inf)
    places = runs[[*_PLACE, "sensitivity_floor"]].drop_duplicates(_PLACE)
    return chosen.assign(error=error).merge(places, on=_PLACE)


def _pairs(runs: pd.DataFrame, before: str, after: str) -> pd.DataFrame:
    """Pairs of runs by two methods: errors, and ratios ``after`` / ``before`` of gain and error."""
    error = np.maximum(runs.error, runs.sensitivity_floor)
    runs = runs[[*_PLACE, "method", "gain"]].assign(error=error)
    one, other = (runs[runs.method == m].drop(columns="method") for m in (before, after))
    both = one.merge(other, on=_PLACE, suffixes=("_before", "_after"))
    both = both[np.isfinite(both.error_before) | np.isfinite(both.error_after)]
    return both[["scene", "group", "error_before", "error_after"]].assign(
        gain=both.gain_after / both.gain_before, error=both.error_after / both.error_before
    )


def _summary(pairs: pd.DataFrame) -> Mapping[str, float]:
    # not imported at the top: SciPy's import takes a second, which planning the workflow saves
    from scipy.stats import binomtest

    by_family = pairs.groupby(pairs.scene.str.removesuffix(results.TWIN)).error
    fallen = int((by_family.median() < 1.0).sum())
    values = [own.to_numpy(float) for _, own in by_family]
    # bootstrap of the median error ratio: families of scenes are drawn with replacement
    size = results.RESAMPLES, len(values)
    drawn = np.random.default_rng(results.SEED).integers(len(values), size=size)
    medians = [np.median(np.concatenate([values[i] for i in row])) for row in drawn]
    low, high = np.percentile(medians, [2.5, 97.5], method="inverted_cdf")
    failing, after = pairs.error_before > results.FAILED, pairs.error_after > results.FAILED
    return {
        "pairs": len(pairs),
        "scenes": pairs.scene.nunique(),
        "failing": int(failing.sum()),
        "rescued": int((failing & ~after).sum()),
        "failing_after": int(after.sum()),
        **pairs[["error_before", "error_after"]].median(),
        "gain_ratio": pairs.gain.median(),
        "error_ratio": pairs.error.median(),
        "error_ratio_low": low,
        "error_ratio_high": high,
        "p_value": binomtest(fallen, by_family.ngroups).pvalue,
        "families": by_family.ngroups,
        "families_fallen": fallen,
        "unexplained_share": ((pairs.gain < 1.0) != (pairs.error < 1.0)).mean(),
    }
