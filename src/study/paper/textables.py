"""TeX tables of the manuscript: functions whose parameters name the study's tables they need."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from inspect import signature
from operator import itemgetter
from typing import Any

import pandas as pd

from study.artifact import words
from study.artifact.text import escape
from study.experiments.alternatives.experiment import NEWTON
from study.experiments.error_budget import PARTS
from study.figures.kit.declaration import declarations
from study.paper.numbers import format_number
from study.tables.claims.claims import NOT_DECIDED
from study.tables.equal_error import AHEAD, REDUCED, SAME
from study.tables.kit.results import FAILED, MEASURES, MEDIAN, over_motions, trained

NONE, TINY = "--", 1e-6
LEFT = r">{\raggedright\arraybackslash}"
NUMBER = r">{\raggedleft\arraybackslash}p{1.5cm}"  # column whose header may have several lines
# Iterator over a table: first (column definitions, header), then the rows; all cells are TeX.
Rows = Iterator[Any]
# TeX tables that may break across pages.
LONG = ("tab_scenes", "tab_trajectories", "tab_claims_in_full")
FULL = "full"  # value of column position_basis for runs whose positions are not reduced


def tabular(
    header: Sequence[str], rows: Sequence[Sequence[str]], columns: str, long: bool = False
) -> str:
    r"""Return a TeX table with ``header`` and ``rows``; ``columns`` has the column types.

    A ``long`` table may break across pages; the source defines its caption as ``\captionrow``.
    """
    head, kind = [r"\hline", _line(header), r"\hline"], "longtable" if long else "tabular"
    if long:
        head = [r"\captionrow", *head, r"\endfirsthead", *head, r"\endhead"]
    lines = [rf"\begin{{{kind}}}{{{columns}}}", *head, *map(_line, rows)]
    return "\n".join([*lines, r"\hline", rf"\end{{{kind}}}"]) + "\n"


def _line(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def _scene(name: str) -> str:
    return escape(words.scene(name))


def _name(text: str) -> str:
    """Format ``text``, the name of a scene, group or method, in typewriter."""
    return rf"\texttt{{{escape(text)}}}"


def _group(group: str) -> str:
    return escape(group.replace("_", " "))


def _whole(value: float) -> str:
    return str(int(value))


def _rounded(value: float) -> str:
    """Format the whole number ``value``, rounded to two digits."""
    return _whole(float(f"{value:.1e}"))


def _known(value: Any, form: Callable[[Any], str] = format_number) -> str:
    """Format ``value`` by ``form``, or return a dash if it is missing."""
    return NONE if pd.isna(value) else form(value)


def _not_tiny(value: float) -> str:
    """Format an error; errors below a millionth only as smaller than this."""
    return format_number(value) if value >= TINY else "$<10^{-6}$"


def _rows(table: pd.DataFrame, **wanted: object) -> pd.DataFrame:
    for column, value in wanted.items():
        table = table[table[column] == value]
    return table


def _cell(rows: pd.DataFrame, shown: Callable[[pd.Series], Any]) -> str:
    """Format the cell that ``shown`` takes from the first row; a dash if ``rows`` is empty."""
    found = shown(rows.iloc[0]) if len(rows) else NONE
    return found if isinstance(found, str) else format_number(found)


_VERDICT_COLOUR = {"holds": "okgreen", "does not hold": "okred"}
_VERDICTS = {"depends": "mixed", "not tested": NONE, "cannot be decided": NONE}
TAIL = " method"
_PARTS = {"published": f"published{TAIL}", "beyond": f"improved{TAIL}"}
# Claim without a figure -> TeX label of the table that shows its result.
_SHOWN = {"C11": "reruns", "C12": "positions"}
_SIGNS = {">=": r"$\ge$", "<=": r"$\le$"}


def _verdict(text: str) -> str:
    return _VERDICTS.get(text, escape(text))


def claims(claims_tests: pd.DataFrame, claims: pd.DataFrame) -> Rows:
    """Tabulate claims: verdicts on the preprint's and improved method, counts of agreeing cases.

    If the deformation error changes a verdict, the cell has the changed verdict, too.
    """
    tests = claims_tests[claims_tests.decides.astype(bool)]
    columns = rf"l{LEFT}p{{4.6cm}}{LEFT}p{{3.2cm}}{LEFT}p{{4.1cm}}l"
    yield columns, ["claim", "the preprint says", *_PARTS.values(), "shown in"]
    for row in claims.itertuples():
        cells = []
        verdicts = (row.verdict, row.verdict_both), (row.verdict_beyond, row.verdict_beyond_both)
        for part, (verdict, both) in zip(_PARTS, verdicts, strict=True):
            mine = _rows(tests, claim=row.claim, part=part).itertuples()
            counted = ", ".join(f"{test.satisfied}/{test.of}" for test in mine)
            colour = _VERDICT_COLOUR.get(verdict, "okgrey")
            other = "" if both == verdict else f"; both errors: {_verdict(both)}"
            shown = rf"\textcolor{{{colour}}}{{{_verdict(verdict)}}}"
            cells.append(shown + (f" ({counted})" if counted else "") + other)
        place = shown = row.figure_or_table
        if row.claim in _SHOWN:
            place = rf"table~\ref{{tab:{_SHOWN[row.claim]}}}"
        else:
            place = rf"figure~\ref{{fig:{shown}}}" if shown in declarations() else _name(shown)
        yield [row.claim, escape(row.paper), *cells, place]


# Change, kind of mesh and row title of each row of the table of paired comparisons.
_CHANGES = (
    ("three elements a mode for one", "sheets", "three elements per mode instead of one, sheets"),
    ("three elements a mode for one", "bars", "three elements per mode instead of one, bars"),
    ("shared coefficients, single rows", "sheets", "one system for all coordinates, sheets"),
    ("shared coefficients, single rows", "bars", "one system for all coordinates, bars"),
    ("whole elements, shared coefficients", "all", "element-wise sampling instead of single rows"),
)  # fmt: skip


def interventions(gain_interventions: pd.DataFrame) -> Rows:
    """Tabulate paired comparisons: ratios of DEIM constants and errors, rescued simulations."""
    header = ["change", "constant", "error", "interval", "decreases in", "rescued"]
    yield "lrrrrr", header
    for step, mesh, change in _CHANGES:
        for row in _rows(gain_interventions, step=step, mesh=mesh).itertuples():
            interval = f"{_known(row.error_ratio_low)} to {_known(row.error_ratio_high)}"
            families = f"{_whole(row.families_fallen)} of {_whole(row.families)}"
            rescued = f"{_whole(row.rescued)} of {_whole(row.failing)}"
            yield [
                change,
                *map(_known, (row.gain_ratio, row.error_ratio)),
                interval,
                families,
                rescued,
            ]


def square(gain_interventions: pd.DataFrame) -> Rows:
    """Tabulate failing simulations and median errors by numbers of systems and elements."""
    yield "lrrrrr", ["", "one: failing", "error", "three: failing", "error", "three to one"]
    for mesh in ("sheets", "bars"):
        for kind in ("separate", "shared"):
            step = f"three elements, {kind} coefficients"
            for row in _rows(gain_interventions, step=step, mesh=mesh).itertuples():
                before, after = (
                    [f"{_whole(failing)} of {_whole(row.pairs)}", _known(error)]
                    for failing, error in (
                        (row.failing, row.error_before), (row.failing_after, row.error_after)
                    )
                )  # fmt: skip
                yield [f"{mesh}, {kind} systems", *before, *after, _known(row.error_ratio)]


def claims_in_full(claims_tests: pd.DataFrame) -> Rows:
    """Tabulate tests that decide verdicts: limit, rows that satisfy it, range of the values."""
    tests = claims_tests[claims_tests.decides.astype(bool)]
    header = ["", "test", "limit", "rows", "least", "median", "most"]
    yield rf"{LEFT}p{{1.9cm}}{LEFT}p{{5.6cm}}rrrrr", header
    for (claim, part), found in tests.groupby(["claim", "part"], sort=False):
        for place, test in enumerate(found.itertuples()):
            limit = f"{_SIGNS[test.compare]} {format_number(test.threshold)}"
            opening = [
                "" if place else f"{claim} {_PARTS[part].removesuffix(TAIL)}",
                escape(test.what),
                limit,
            ]
            spread = map(_known, (test.least, test.median, test.most))
            yield [*opening, f"{test.satisfied} of {test.of}", *spread]


def replications(replication: pd.DataFrame) -> Rows:
    """Tabulate verdicts of the study and of replications; a dash where no verdict is decided."""
    names = list(replication.replication.unique())
    heads = [cell for part in _PARTS.values() for cell in (f"{part}: study", *names)]
    yield "l" * (1 + len(heads)), ["", *heads]
    for claim, rows in replication.groupby("claim", sort=False):
        cells = []
        for part in _PARTS:
            own = _rows(rows, part=part)
            cells += [own.verdict.iloc[0], *own.verdict_replication]
        yield [claim, *(NONE if cell in NOT_DECIDED else _verdict(cell) for cell in cells)]


# Columns of the table of iterations: (method, number K of local-global iterations in a frame).
_RUNS = (("fom", 1), ("fom", 5), ("fom", 10), ("fom", 40), ("fom-anderson", 10))


def iterations(accuracy_cost: pd.DataFrame) -> Rows:
    """Tabulate full-order runs with K iterations: error against converged steps, frame time."""

    def text(run: pd.Series) -> str:
        error, time = map(format_number, (run.relative_error_within_horizon, run.ms_per_frame))
        return f"{error} ({time})"

    titles = [
        f"$K = {count}$" + (", accelerated" if method != "fom" else "") for method, count in _RUNS
    ]
    yield "l" + "r" * len(_RUNS), ["scene", *titles]
    for scene, part in accuracy_cost.groupby("scene", sort=False):
        runs = [_rows(part, method=method, iterations=count) for method, count in _RUNS]
        yield [_scene(scene), *(_cell(run, text) for run in runs)]


_TOLERANCE = "ecsw-1e-02"


def positions(reduced_reruns: pd.DataFrame) -> Rows:
    """Tabulate errors and speed-ups in position subspaces of the largest dimension k per scene."""

    def unseen(run: pd.Series) -> str:
        same = {column: run[column] for column in ("scene", "method", "k", "position_basis")}
        motions = over_motions(_rows(reduced_reruns, group="all", **same))
        return _cell(motions, itemgetter(MEDIAN))

    error = itemgetter("relative_error_within_horizon")
    columns: dict[str, tuple[str, str, Callable[[pd.Series], Any]]] = {
        "all": ("pod", "full", error),
        "all, tests": ("pod", "full", unseen),
        "sampled": ("pod", _TOLERANCE, error),
        "sampled, tests": ("pod", _TOLERANCE, unseen),
        "elements": ("pod", _TOLERANCE, lambda run: _whole(run.r)),
        "speed-up": ("pod", _TOLERANCE, itemgetter("speedup")),
        "fitted": ("pod", "hrpd", error),
        "skinning, all": ("skinning", "full", error),
    }
    yield "l" + NUMBER * len(columns), ["scene", *columns]
    for scene in reduced_reruns.scene.unique():
        runs = trained(_rows(reduced_reruns, scene=scene, group="all"))
        runs = runs[runs.k == runs.k.max()]
        if len(runs):
            cells = [
                _cell(_rows(runs, position_basis=basis, method=method), text)
                for basis, method, text in columns.values()
            ]
            yield [_scene(scene), *cells]


def speedups(speedups: pd.DataFrame) -> Rows:
    """Tabulate speed-ups that the text cites, with intervals, errors and costs of training."""
    heads = "full ms", "training", "tests", "repaid"
    yield f"ll{2 * 'r'}{2 * NUMBER}{NUMBER}", ["scene", "reduction", "speed-up", *heads]
    for row in speedups.itertuples():
        size = f"r = {int(row.r)}" if row.position_basis == FULL else f"k = {int(row.k)}"
        frames = row.frames_to_break_even  # frames after which saved time exceeds training time
        yield [
            _scene(row.scene),
            f"{escape(words.method(row.method))}, ${size}$",
            _known(row.shown, escape),
            *map(_known, (row.full_ms, row.error_train, row.error_heldout)),
            "never" if pd.isna(frames) else _rounded(frames),
        ]


# Position basis, method and row title of each row of the table of accurate simulations.
_COMPARED = (
    (FULL, "fewer-iterations", "full-order model, fewer iterations"),
    (FULL, "coarser-mesh", "full-order model, coarser mesh"),
    (FULL, "published", "preprint's code"),
    (FULL, "deim-joint", "preprint's selection"),
    (FULL, "deim", "entry-wise DEIM"),
    (FULL, "block-deim", "element-wise DEIM"),
    (FULL, "gappy", "three elements per mode"),
    (FULL, "pod", "orthogonal projection, all elements"),
    ("pod", "ecsw-1e-02", "reduced positions (ECSW)"),
    ("pod", "full", "reduced positions, all elements"),
)


def payoff(payoff: pd.DataFrame) -> Rows:
    """Tabulate in how many cases a method is accurate, and faster than the full-order model."""
    header = ["method", "cases", "accurate", "on test trajectories", "faster", "speed-up"]
    yield "lrrrrr", header
    for basis, method, title in _COMPARED:
        own = _rows(payoff, measure=MEASURES[0], position_basis=basis, method=method)
        for row in own.itertuples():
            test = _whole(row.accurate_heldout) if row.heldout else NONE
            counts = map(_whole, (row.scenes, row.accurate))
            yield [title, *counts, test, _known(row.pays, _whole), _known(row.best_speedup)]


APART = 2.0  # smallest ratio of validation errors of successive rows of the table frontier


def _setting(row: Any) -> str:
    """Describe a row of the table frontier: mesh or model, iterations, training."""
    if pd.isna(row.method):
        return NONE
    solve = "converged" if pd.isna(row.iterations) else f"$K = {_whole(row.iterations)}$"
    solve = solve.replace("$K", "$K_N") if row.method == NEWTON else solve
    solve += ", accelerated" if str(row.method).endswith("anderson") else ""
    if row.part != REDUCED:
        return f"{_whole(row.simulated)} vertices, {solve}"
    skinning = 0 if pd.isna(row.skinning) else row.skinning
    size = _whole(row.k - skinning) + (f" + {_whole(skinning)}" if skinning else "")
    trained = f"$n = {_whole(row.training_motions)}$"
    return rf"{size}, $\tau = {row.tolerance:g}$, {solve}, {trained}"


def frontier(frontier: pd.DataFrame) -> Rows:
    """Tabulate best reduced models and coarser meshes, chosen on validation trajectories.

    Settings with a validation error above 10 %, or more than half of the error in the row before,
    are left out.
    """
    header = ["scene", "setting", "validation", "test", "time", "training", "ahead"]
    yield "llrrrrr", header
    shown = frontier[(frontier.part != SAME) & ~(frontier.validation_error > FAILED)]
    for (scene, vertices, _), own in shown.groupby(["scene", "vertices", "part"], sort=False):
        opening, before = f"{_scene(scene)}, {_whole(vertices)}", math.inf
        for row in own.itertuples():
            if row.validation_error > before / APART:
                continue
            errors = map(_known, (row.validation_error, row.position_error))
            first = [opening, _setting(row), *errors]
            training = _known(row.offline_ratio, _rounded)
            ahead = [getattr(row, name) for name in list(AHEAD)[:2] if row.part == REDUCED]
            yield [*first, _known(row.time_ratio), training, " / ".join(map(_known, ahead)) or NONE]
            opening, before = "", row.validation_error


def scenes(reduced_reruns: pd.DataFrame, scenes: pd.DataFrame) -> Rows:
    """Tabulate scenes: name in the code, groups, mesh size, frames, first unpredictable frame."""
    horizon = trained(reduced_reruns).groupby("scene").horizon_frame.first()
    header = ["scene", "name", "groups (weight)", "vertices", "elements", "frames", "horizon"]
    yield rf"ll{LEFT}p{{2.5cm}}rrrr", header
    for row in scenes.itertuples():
        end = horizon.get(row.scene)
        shown = "run" if end == row.frames and not pd.isna(end) else _known(end, _whole)
        # numbers such as 1e+06 are written as powers of ten
        powers = re.sub(r"([\d.]+)e\+?(-?)0*(\d+)", r"$\1\\cdot 10^{\2\3}$", _group(row.groups))
        sizes = map(str, (row.vertices, row.elements, row.frames))
        names = _scene(row.scene), _name(row.scene)
        yield [*names, powers.replace(r"$1\cdot 10", "$10"), *sizes, shown]


def trajectories(test_trajectories: pd.DataFrame) -> Rows:
    """Tabulate test trajectories: non-rigid, non-affine parts; errors of replay, FOM, reference."""
    columns = {
        "rigid": "deformation", "affine": "affine", "replay": "replay_error",
        "shape": "replay_deformation_error", "full order": "full_order_error",
        "its shape": "full_order_deformation_error", "reference": "reference_deformation_error",
    }  # fmt: skip
    yield "ll" + "r" * len(columns), ["scene", "", *columns]
    for _, row in test_trajectories.iterrows():
        first = _scene(row.scene), words.TRAJECTORIES[row.motion]
        yield [*first, *(_known(row[name], _not_tiny) for name in columns.values())]


def error_budget(error_budget: pd.DataFrame) -> Rows:
    """Tabulate median deformation errors of test trajectories by part, and the largest part."""
    parts = ["iterations" if part == "run" else part.replace("_", " ") for part in PARTS]
    yield "lr" + "r" * (len(parts) + 1), ["scene", "modes", *parts, "largest"]
    for (scene, k, skinning), own in error_budget.groupby(["scene", "k", "skinning"], sort=False):
        error = own.deformation_error.fillna(own.error)
        medians = error.groupby(own.part).median().reindex(PARTS)
        most = own.part[own.largest.astype(bool)].value_counts()
        largest = ", ".join(f"{part} {n}" for part, n in most.items()).replace("run", "iterations")
        size = f"{k}" + (f" + {skinning}" if skinning else "")
        yield [_scene(scene), size, *map(_known, medians), largest]


def methods(methods: pd.DataFrame) -> Rows:
    """Tabulate methods: centring, rows, choice and number of samples, solver for coefficients."""
    yield "lllllll", ["method", "name", "centring", "rows", "selection", "samples", "solve"]
    for row in methods.itertuples():
        least = "one" if row.oversampling == 1 else row.oversampling
        bound = row.gain_bound
        samples = f"{least} per mode" if pd.isna(bound) else rf"$\gamma \le {bound:g}$"
        chosen = [NONE, NONE] if row.rows == "all" else [row.selection, samples]
        own = escape(words.method(row.method, row.title))
        titles = [own, _name(row.method), row.centring, row.rows]
        yield [*titles, *chosen, row.solve]


def reruns(reduced_reruns: pd.DataFrame, methods: pd.DataFrame) -> Rows:
    """Tabulate the relative error of each method at its largest basis size, up to the horizon."""

    def text(run: pd.Series) -> str:
        if not pd.isna(run.relative_error_within_horizon):
            return format_number(run.relative_error_within_horizon)
        if pd.isna(run.blowup_frame):
            return "stopped"
        return rf"\textcolor{{okred}}{{blow-up, {int(run.blowup_frame)}}}"

    table = _rows(trained(reduced_reruns), position_basis=FULL)
    ran = table[(table.frames > 0) | table.blowup_frame.notna()]
    yield (
        "ll" + NUMBER * len(methods),
        ["scene", "group", *map(escape, map(words.method, methods.method))],
    )
    for (scene, group), part in ran.groupby(["scene", "group"], sort=False):
        runs = [_rows(part, method=method).sort_values("r").tail(1) for method in methods.method]
        yield [_scene(scene), _group(group), *(_cell(run, text) for run in runs)]


_OUTCOMES = ("accurate", "wrong", "left the scene", "blow-up")


def stability(stability: pd.DataFrame) -> Rows:
    """Tabulate runs by method and outcome, and energies relative to the full-order run.

    The last two columns summarise short runs with other time steps h or other stiffness.
    """
    full_order = (stability.method == "full") & (stability.position_basis == FULL)
    table = stability[(stability.outcome != "not run") & ~full_order]
    last = ["energy (median)", "(max)", "$h$, stiffness: accurate", "energy (max)"]
    last = last if (table.experiment == "sweep").any() else last[:2]
    header = ["method", *_OUTCOMES, *last]
    yield "l" + r">{\raggedleft\arraybackslash}p{1.25cm}" * (len(header) - 1), header
    for (basis, method), part in table.groupby(["position_basis", "method"], sort=False):
        runs, sweep = (_rows(part, experiment=kind) for kind in ("rerun", "sweep"))
        energies = runs.energy_ratio.median(), runs.energy_ratio.max(), sweep.energy_ratio.max()
        median, largest, of_sweep = map(format_number, energies)
        accurate = f"{(sweep.outcome == 'accurate').sum()} of {len(sweep)}"
        counts = [str((runs.outcome == outcome).sum()) for outcome in _OUTCOMES]
        own = words.method(method) if method != "full" else "reduced positions, all elements"
        sampled = method.startswith("ecsw-")
        tolerance = rf", $\tau = {format_number(float(method[5:]))}$" if sampled else ""
        columns = "" if basis == FULL else f", {'POD' if basis == 'pod' else basis} columns"
        title = f"{escape(own)}{tolerance}{columns}"
        yield [title, *counts, median, largest, accurate, of_sweep][: len(header)]


TEX_TABLES: dict[str, Callable[..., Rows]] = {
    f"tab_{make.__name__}": make
    for make in (
        claims, claims_in_full, interventions, square, replications, scenes, methods, reruns,
        stability, iterations, positions, speedups, payoff, frontier, trajectories, error_budget,
    )
}  # fmt: skip


def reads(name: str) -> list[str]:
    """Return the names of the study's tables from which the TeX table ``name`` is made."""
    return list(signature(TEX_TABLES[name]).parameters)


def tex_rows(name: str, tables: Mapping[str, pd.DataFrame]) -> Rows:
    """Yield column definitions and header of the TeX table ``name``, then its rows."""
    return TEX_TABLES[name](*(tables[read] for read in reads(name)))


def tex_table(name: str, tables: Mapping[str, pd.DataFrame]) -> str:
    """Return the TeX table ``name``; ``tables`` maps names to the study's tables."""
    (columns, header), *rows = tex_rows(name, tables)
    return tabular(header, rows, columns, long=name in LONG)
