"""Tables of errors: of reconstructions, of perturbed runs, and of runs with one changed choice.

The DEIM constant (column gain) bounds the factor by which sampling amplifies errors. Table
gain_interventions shows whether the error of a run falls if only this constant is lowered. Each
step compares two methods with the same basis and size r and other samples, or with separate in
place of shared coefficients of x, y and z. If separate coefficients raised errors only by the
constant, errors would also fall with it among methods of the same kind of coefficients (`KINDS`).
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

_SMALL = "empty: rounding errors"
# Rounding errors change errors of approximations less than those of runs: by at most 7e-4.
_approximation = partial(number, compared="value", tolerance=0.005)
_CELL = ["scene", "group", "method", "r", "varied"]


@table(
    title="Singular values of the training snapshots",
    columns=(
        *shared("scene group"),
        integer("component", "number of the mode, from 1"),
        number("singular_value", "singular value of snapshots", "unit of the group's projections"),
        number("relative", "singular value over the first one"),
        flag("above_roundoff", "singular value exceeds rounding errors of the projections"),
    ),
    # The basis of a group is its `USUAL_BASIS` (no weights, not centred) if the study has it.
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
        text("split", "reconstructed snapshots: train, test (frames between), heldout"),
        _approximation("relative_error", f"relative error of the projections; {_SMALL}"),
        *(_approximation(f"relative_error_{a}", f"error along {a}; {_SMALL}") for a in "xyz"),
        *shared("gain"),
        integer("rows_sampled", "number of evaluated rows of projections", compared="value"),
        *shared("elements_sampled"),
    ),
    reads={"rows": Rows(paths.RECONSTRUCTION)},
)
def reconstruction_error(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ``rows`` of all scenes, groups and methods."""
    return rows


@table(
    title="Relative difference of perturbed full-order runs",
    columns=(
        *shared("scene"),
        text("perturbation", "initial displacement over the extent, or the change of the run"),
        integer("frame", "number of the frame, from 0"),
        number("relative_difference", "largest relative difference over seeds", compared="error"),
    ),
    reads={"rows": Rows(paths.SENSITIVITY)},
)
def sensitivity(rows: pd.DataFrame) -> pd.DataFrame:
    """Relative difference of perturbed and unperturbed runs: largest over seeds, for each frame."""
    frames = rows.groupby(["scene", "perturbation", "frame"], sort=False, as_index=False)
    return frames.relative_difference.max()


@table(
    title="Reduced runs with bases of rounding errors",
    columns=(
        *shared("scene group"),
        text(
            "noisy_axes",
            "axes with rounding errors at the start: all; the plane of a flat mesh; or this plane "
            "and, at one vertex, the axis normal to it",
        ),
        integer("seed", "seed of the rounding errors at the start"),
        *shared("method r"),
        integer("rank", "number of modes of the snapshots, without a cutoff", compared="value"),
        # Modes made of rounding errors, and thus their DEIM constant, depend on the machine.
        replace(*shared("gain"), compared="skipped"),
        *shared("frames finite blowup_frame reference"),
        number("relative_error", "position error before the horizon"),
    ),
    reads={"rows": Rows(paths.NOISE)},
)
def noise(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ``rows`` of all scenes and groups."""
    return rows.assign(reference=declaration.ITERATIONS)


@table(
    title="Runs repeated with other training frames or perturbed initial positions",
    columns=(
        *shared("scene group method r"),
        text("varied", "training (frames), start (positions), number of training trajectories"),
        integer("repetitions", "n runs; the true median is in their range with p = 1 - 2^(1-n)"),
        integer("ended", "number of runs that blew up, with an infinite error", compared="error"),
        *shared("reference"),
        number("error_median", "median position error before the horizon"),
        *declaration.extremes("error"),
        number("gain_median", "median `gain` of all runs"),
        *declaration.extremes("gain"),
        number("spread", "largest error over least error", compared="error"),
    ),
    reads={"rows": Rows(paths.REPETITIONS)},
)
def repetitions(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per scene, group, method, r and ``varied``, which names the varied quantity."""
    cells = rows.assign(infinite=np.isinf(rows.error)).groupby(_CELL, sort=False)
    ends = {"median": "median", "low": "min", "high": "max"}
    found = {f"{n}_{end}": (n, how) for n in ("error", "gain") for end, how in ends.items()}
    made = cells.agg(repetitions=("error", "size"), ended=("infinite", "sum"), **found)
    spread = made.error_high / made.error_low
    return made.assign(spread=spread, reference=declaration.ITERATIONS).reset_index()


@table(
    title="Ablation from the choices of the published code to those of the improved method",
    columns=(
        *shared("scene group"),
        text(
            "direction",
            "up: from the published code; down: from the improved method; signs: of the modes; "
            "square: kinds of coefficients and samples combined",
        ),
        text("rung", "choice that the ablation step changes"),
        integer("rows_per_element", "number of rows of an element"),
        integer("entries", "number of entries that determine the coefficients", compared="value"),
        *shared("r"),
        number("condition", "condition number of the sampled modes"),
        *shared("gain"),
        number("error_train", "reconstruction error of the training snapshots"),
        number("error_heldout", "reconstruction error of a test trajectory"),
        *shared("finite blowup_frame reference relative_error_within_horizon"),
        integer("repetitions", "number of runs trained on other frames"),
        number("error_median", "median error of these runs; inf: a run blew up"),
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
# samples (elements are compared with single rows only if elements have several rows).
_SAMPLES = "single rows", "whole elements", "three elements"
SQUARE = {
    **{f"shared coefficients, {own}": (f"{own}, separate", f"{own}, shared") for own in _SAMPLES},
    **{
        f"{after}, {kind} coefficients": (f"{before}, {kind}", f"{after}, {kind}")
        for before, after in (_SAMPLES[1:], _SAMPLES[:2])
        for kind in ("separate", "shared")
    },
}
# Step -> methods; of any two, that with the larger DEIM constant is "before" the step.
KINDS = {
    "lower gain, shared coefficients": ("deim", "block-deim", "gappy"),
    "lower gain, separate coefficients": ("deim-joint", "published"),
}
_PLACE = ["scene", "group", "r"]
VOLUMES = ("deformation_gradient", "tetrahedron_strain", "volume")  # groups on tetrahedra
MESHES = "all", "sheets", "bars"
# Makes a column of numbers that summarise many runs, with the tolerance of "share" columns.
share = partial(number, compared="share")


@table(
    title="Changes of the error if the DEIM constant is lowered and the basis is the same",
    columns=(
        text("step", f"change, one of: `{'; '.join([*STEPS, *SQUARE, *KINDS])}`"),
        text("mesh", f"meshes of the pairs: {', '.join(MESHES)}"),
        text("method_before", "method before the step"),
        text("method_after", "method after the step, with the same basis"),
        count("pairs", "scenes, groups and sizes with runs of the two methods"),
        count("scenes", "number of scenes of the pairs"),
        count("failing", "pairs whose error before exceeds 10 %"),
        count("rescued", "failing pairs whose error after is at most 10 %"),
        count("failing_after", "pairs whose error after exceeds 10 %"),
        share("error_before", "median error before the step; inf: a run blew up"),
        share("error_after", "median error after the step"),
        *shared("reference"),
        share("gain_ratio", "median ratio of the DEIM constants, after over before"),
        share("error_ratio", "median ratio of the errors, after over before"),
        *declaration.interval("error_ratio_low error_ratio_high", share),
        share("p_value", "two-sided sign test over families; a tie counts as no decrease"),
        count("families", "number of families: a scene and its short variant are one"),
        count("families_fallen", "families whose median error ratio is below 1"),
        share("unexplained_share", "share of pairs in which only constant or only error decreases"),
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
    """One row for each step (change of method that lowers the DEIM constant) and kind of mesh.

    A scene and its short variant are a family: the bootstrap resamples families, the sign test
    counts them. Errors below the sensitivity floor are raised to it. A run that blew up has an
    infinite error; two runs that blew up are not compared.
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
    """Pairs of runs of two methods: errors, ratios ``after`` / ``before`` of constant and error."""
    error = np.maximum(runs.error, runs.sensitivity_floor)
    runs = runs[[*_PLACE, "method", "gain"]].assign(error=error)
    one, other = (runs[runs.method == m].drop(columns="method") for m in (before, after))
    both = one.merge(other, on=_PLACE, suffixes=("_before", "_after"))
    both = both[np.isfinite(both.error_before) | np.isfinite(both.error_after)]
    return both[["scene", "group", "error_before", "error_after"]].assign(
        gain=both.gain_after / both.gain_before, error=both.error_after / both.error_before
    )


def _summary(pairs: pd.DataFrame) -> Mapping[str, float]:
    # Imported here because the import takes a second and planning the workflow does not need SciPy.
    from scipy.stats import binomtest

    by_family = pairs.groupby(pairs.scene.str.removesuffix(results.TWIN)).error
    fallen = int((by_family.median() < 1.0).sum())
    values = [own.to_numpy(float) for _, own in by_family]
    # Bootstrap of the median error ratio: families of scenes are drawn with replacement.
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
