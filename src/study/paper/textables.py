"""Tables of the manuscript as TeX, generated from ``tables`` of the study by name."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd

from pdrom.view.text import escape
from study.figures.kit.declaration import declarations
from study.paper.macros import format_number
from study.tables.alternatives import CURVE
from study.tables.kit.parts import in_words
from study.tables.kit.reruns import MEDIAN, over_motions, trained

Tables = Mapping[str, pd.DataFrame]


def tabular(header: Sequence[str], rows: Sequence[Sequence[str]], columns: str) -> str:
    """A tabular of ``rows`` with a ruled ``header``; cells are TeX already, as is ``columns``."""
    lines = [rf"\begin{{tabular}}{{{columns}}}", *_head(header), *map(_line, rows)]
    return "\n".join([*lines, r"\hline", r"\end{tabular}"]) + "\n"


def longtable(header: Sequence[str], rows: Sequence[Sequence[str]], columns: str) -> str:
    r"""Table that may break across pages, below ``\captionrow``, which the text defines."""
    head = _head(header)
    lines = [rf"\begin{{longtable}}{{{columns}}}", r"\captionrow", *head, r"\endfirsthead"]
    lines += [*head, r"\endhead", *map(_line, rows)]
    return "\n".join([*lines, r"\hline", r"\end{longtable}"]) + "\n"


def _head(header: Sequence[str]) -> list[str]:
    return [r"\hline", _line(header), r"\hline"]


def _line(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def name(text: str) -> str:
    """Name ``text`` of a scene, group or method, in typewriter."""
    return rf"\texttt{{{escape(text)}}}"


_VERDICT_COLOUR = {"holds": "okgreen", "does not hold": "okred"}
_PARTS = {"published": "as published", "beyond": "beyond"}
# Where the manuscript shows what a claim without a figure rests on.
_SHOWN = {"C11": "reruns", "C12": "positions"}
_SIGNS = {">=": r"$\ge$", "<=": r"$\le$"}


def claims(tables: Tables) -> str:
    """Both verdicts on each claim, with how many rows agree in the tests that decide it."""
    tests = tables["claims_tests"]
    tests = tests[tests.decides.astype(bool)]
    rows = []
    for row in tables["claims"].itertuples():
        mine = tests[tests.claim == row.claim]
        cells = [
            _verdict(verdict, mine[mine.part == part])
            for part, verdict in zip(_PARTS, (row.verdict, row.verdict_beyond), strict=True)
        ]
        rows.append([row.claim, escape(row.paper), *cells, _place(row.claim, row.figure_or_table)])
    header = ["claim", "the preprint says", "as published", "beyond", "shown in"]
    left = r">{\raggedright\arraybackslash}"
    return tabular(header, rows, rf"l{left}p{{4.7cm}}{left}p{{3.2cm}}{left}p{{4.1cm}}l")


def _verdict(verdict: str, tests: pd.DataFrame) -> str:
    colour = _VERDICT_COLOUR.get(verdict, "okgrey")
    counted = ", ".join(f"{test.satisfied}/{test.of}" for test in tests.itertuples())
    return rf"\textcolor{{{colour}}}{{{escape(verdict)}}} ({counted})"


def _place(claim: str, shown: str) -> str:
    """Reference to a figure or table of the manuscript, or the name of a table of results."""
    if claim in _SHOWN:
        return rf"table~\ref{{tab:{_SHOWN[claim]}}}"
    return rf"figure~\ref{{fig:{shown}}}" if shown in declarations() else name(shown)


def claims_in_full(tables: Tables) -> str:
    """Every test that decides a verdict, with what was found."""
    tests = tables["claims_tests"]
    tests = tests[tests.decides.astype(bool)]
    rows = []
    for (claim, part), found in tests.groupby(["claim", "part"], sort=False):
        for place, test in enumerate(found.itertuples()):
            rows.append(["" if place else f"{claim} {_PARTS[part]}", *_test(test)])
    header = ["", "test", "limit", "rows", "least", "median", "most"]
    return tabular(header, rows, "llrrrrr")


def _test(row: Any) -> list[str]:
    """Describe a test: its limit, how many rows satisfy it, and the range of the values."""
    spread = (row.least, row.median, row.most)
    values = ["--" if pd.isna(value) else format_number(value) for value in spread]
    limit = f"{_SIGNS[row.compare]} {format_number(row.threshold)}"
    return [escape(row.what), limit, f"{row.satisfied} of {row.of}", *values]


NONE = "--"
# Runs of the table of iterations: method and iterations K.
_RUNS = (("fom", 1), ("fom", 5), ("fom", 10), ("fom", 40), ("fom-anderson", 10))
_TOLERANCE = "ecsw-1e-02"


def iterations(tables: Tables) -> str:
    """Error against the converged run and time per frame of full-order runs."""
    table = tables["accuracy_cost"]
    rows = []
    for scene in table.scene.unique():
        cells = [
            _cell(
                _rows(table, scene=scene, method=method, iterations=count),
                lambda run: (
                    f"{format_number(run.relative_error_within_horizon)} "
                    f"({format_number(run.ms_per_frame)})"
                ),
            )
            for method, count in _RUNS
        ]
        rows.append([name(scene), *cells])
    titles = [
        f"$K = {count}$" + (", accelerated" if method != "fom" else "") for method, count in _RUNS
    ]
    return tabular(["scene", *titles], rows, "l" + "r" * len(_RUNS))


def positions(tables: Tables) -> str:
    """Errors and speed-ups in position subspaces of the largest dimension k."""
    table = tables["reduced_reruns"]
    rows = []
    for scene in table.scene.unique():
        runs = trained(_rows(table, scene=scene, group="all"))
        if runs.empty:
            continue
        largest = runs[runs.k == runs.k.max()]
        rows.append([name(scene), *_of_subspaces(largest, table)])
    header = [
        "scene", "all", "all, held out", "sampled", "sampled, held out", "elements", "speed-up",
        "hrpd", "skinning, all",
    ]  # fmt: skip
    return tabular(header, rows, "l" + "r" * 8)


def _of_subspaces(runs: pd.DataFrame, reruns: pd.DataFrame) -> list[str]:
    def error(run: pd.Series) -> str:
        return format_number(run.relative_error_within_horizon)

    def unseen(run: pd.Series) -> str:
        same = _rows(
            reruns, scene=run.scene, group="all", method=run.method, k=run.k,
            position_basis=run.position_basis,
        )  # fmt: skip
        return _cell(over_motions(same), lambda found: format_number(found[MEDIAN]))

    full = _rows(runs, position_basis="pod", method="full")
    sampled = _rows(runs, position_basis="pod", method=_TOLERANCE)
    return [
        _cell(full, error),
        _cell(full, unseen),
        _cell(sampled, error),
        _cell(sampled, unseen),
        _cell(sampled, lambda run: str(int(run.r))),
        _cell(sampled, lambda run: format_number(run.speedup)),
        _cell(_rows(runs, position_basis="pod", method="hrpd"), error),
        _cell(_rows(runs, position_basis="skinning", method="full"), error),
    ]


_METHODS = ("deim-joint", "block-deim", "gappy")


def break_even(tables: Tables) -> str:
    """Size r from which a reduced local step takes longer than the full one."""
    table = tables["breakeven"]
    rows = []
    keys = ["scene", "group", "vertices"]
    for (scene, group, vertices), part in table.groupby(keys, sort=False):
        cells = [_break_even(_rows(part, method=method)) for method in _METHODS]
        rows.append([name(scene), escape(group.replace("_", " ")), str(int(vertices)), *cells])
    titles = [escape(method) for method in _METHODS]
    return tabular(["scene", "group", "vertices", *titles], rows, "llr" + "r" * len(titles))


def _break_even(part: pd.DataFrame) -> str:
    if part.empty:
        return NONE
    crossed = part.breakeven_r.dropna()
    return "pays" if crossed.empty else str(int(crossed.max()))


def _rows(table: pd.DataFrame, **wanted: object) -> pd.DataFrame:
    for column, value in wanted.items():
        table = table[table[column] == value]
    return table


def _cell(rows: pd.DataFrame, text: Callable[[pd.Series], str]) -> str:
    """Text of the only row; nothing where there is none."""
    return text(rows.iloc[0]) if len(rows) else NONE


FULL = "full"  # position basis of unreduced positions


def speedups(tables: Tables) -> str:
    """Each quoted speed-up with its interval, its errors and what it costs."""
    rows = [
        [
            name(row.scene),
            name(
                f"{row.method}, r = {int(row.r)}"
                if row.position_basis == FULL
                else f"{row.method}, k = {int(row.k)}"
            ),
            _number(row.full_ms),
            escape(row.shown) + (" (loses)" if row.loses else ""),
            _number(row.error_train),
            _number(row.error_heldout),
            _number(row.training_s),
            _number(row.reduction_s),
            "never" if pd.isna(row.frames_to_break_even) else _whole(row.frames_to_break_even),
        ]
        for row in tables["speedups"].itertuples()
    ]
    header = ["scene", "reduction", "full ms", "speed-up", "training", "held out", "run (s)",
              "reduction (s)", "frames"]  # fmt: skip
    return tabular(header, rows, "llrlrrrrr")


def payoff(tables: Tables) -> str:
    """Numbers of scenes in which each reduction is accurate, pays, and loses."""
    rows = [
        [
            name(
                row.method if row.position_basis == FULL else f"{row.method}, {row.position_basis}"
            ),
            str(row.scenes),
            str(row.accurate),
            str(row.pays),
            str(row.loses),
            *(_number(v) for v in (row.least_speedup, row.best_speedup, row.most_speedup)),
            _number(row.error_train),
            f"{_number(row.error_heldout)} ({row.heldout})",
            str(row.accurate_heldout),
            str(row.pays_heldout),
        ]
        for row in tables["payoff"].itertuples()
    ]
    header = ["reduction", "runs in", "accurate in", "pays in", "loses in", "least", "median",
              "most", "training", "held out (of)", "accurate", "pays"]  # fmt: skip
    return tabular(header, rows, "lrrrrrrrrrrr")


def pays(tables: Tables) -> str:
    """Mesh sizes from which a reduction is faster than others, for each error that it reaches."""
    rows = []
    for _, curve in tables["winners"].groupby(CURVE, sort=False):
        row, smallest, largest = curve.iloc[0], curve.vertices.min(), curve.vertices.max()
        if not pd.isna(row.speedup):
            stiffness = "" if row.stiffness == 1.0 else rf" $\times {row.stiffness:g}$"
            rows.append(
                [
                    name(row.scene) + stiffness,
                    row.reference,
                    format_number(row.limit),
                    str(smallest) if smallest == largest else f"{smallest} to {largest}",
                    _size(row.from_plain),
                    _size(row.from_best),
                    in_words(row.speedup, row.speedup_low, row.speedup_high),
                    f"{row.reached} of {row.motions}",
                ]
            )
    header = ["scene", "against", "error", "vertices", "plain", "all", "speed-up", "motions"]
    return tabular(header, rows, "lllrrrrr")


def _size(vertices: Any) -> str:
    return "--" if pd.isna(vertices) else str(int(vertices))


def _number(value: float) -> str:
    return "--" if pd.isna(value) else format_number(value)


def _whole(value: float) -> str:
    """Two digits of a count, written out."""
    return str(int(float(f"{value:.1e}")))


def scenes(tables: Tables) -> str:
    """Scenes with their groups, sizes and horizons."""
    horizon = trained(tables["reduced_reruns"]).groupby("scene").horizon_frame.first()
    rows = []
    for row in tables["scenes"].itertuples():
        end = horizon.get(row.scene)
        shown = "--" if pd.isna(end) else "run" if end == row.frames else str(int(end))
        groups = escape(row.groups.replace("_", " "))
        # numbers such as 1e+06 as powers of ten
        powers = re.sub(r"([\d.]+)e\+?(-?)0*(\d+)", r"$\1\\cdot 10^{\2\3}$", groups)
        groups = powers.replace(r"$1\cdot 10", "$10")
        rows.append(
            [name(row.scene), groups, str(row.vertices), str(row.elements), str(row.frames), shown]
        )
    header = ["scene", "groups (weight)", "vertices", "elements", "frames", "horizon"]
    return longtable(header, rows, r"l>{\raggedright\arraybackslash}p{5.2cm}rrrr")


def methods(tables: Tables) -> str:
    """Ingredients of each method."""
    rows = [
        [
            name(row.method),
            escape(row.title),
            row.centring,
            row.rows,
            row.selection if row.rows != "all" else "--",
            _samples(row),
            row.solve,
        ]
        for row in tables["methods"].itertuples()
    ]
    header = ["method", "title", "centring", "rows", "selection", "samples", "solve"]
    return tabular(header, rows, r"l>{\raggedright\arraybackslash}p{3.3cm}lllll")


def _samples(row: Any) -> str:
    """Number of samples that a method takes."""
    if row.rows == "all":
        return "--"
    least = "one a mode" if row.oversampling == 1 else f"{row.oversampling} a mode"
    return least if pd.isna(row.gain_bound) else rf"$\gamma \le {row.gain_bound:g}$"


def ranks(tables: Tables) -> str:
    """Numerical rank and decay of each group's snapshots."""
    rows = []
    for (scene, group), part in tables["singular_values"].groupby(["scene", "group"], sort=False):
        real = part[part.above_roundoff]
        cells = [real[real.component == component].relative for component in (6, 10, 20)]
        decay = [format_number(cell.iloc[0]) if len(cell) else "--" for cell in cells]
        rows.append([name(scene), escape(group.replace("_", " ")), str(len(real)), *decay])
    header = ["scene", "group", "rank", r"$\sigma_6/\sigma_1$", r"$\sigma_{10}/\sigma_1$",
              r"$\sigma_{20}/\sigma_1$"]  # fmt: skip
    return longtable(header, rows, "llrrrr")


def reruns(tables: Tables) -> str:
    """Error within the horizon of every method at r = 20 and at full rank."""
    table = trained(tables["reduced_reruns"])
    table = table[table.position_basis == "full"]
    order = list(tables["methods"].method)
    rows = []
    for (scene, group), part in table.groupby(["scene", "group"], sort=False):
        if not (part.frames > 0).any() and not part.blowup_frame.notna().any():
            continue
        cells = [_rerun_cell(part[part.method == method]) for method in order]
        rows.append([name(scene), escape(group.replace("_", " ")), *cells])
    header = ["scene", "group", *(escape(m) for m in order)]
    return tabular(header, rows, "ll" + "r" * len(order))


def _rerun_cell(part: pd.DataFrame) -> str:
    """Error at the largest size that the numerical rank allows."""
    ran = part[(part.frames > 0) | part.blowup_frame.notna()].sort_values("r")
    if ran.empty:
        return "--"
    last = ran.iloc[-1]
    if pd.isna(last.relative_error_within_horizon) and pd.isna(last.blowup_frame):
        return "stopped"
    if pd.isna(last.relative_error_within_horizon):
        return rf"\textcolor{{okred}}{{blow-up, {int(last.blowup_frame)}}}"
    return format_number(last.relative_error_within_horizon)


def local_share(tables: Tables) -> str:
    """Share of the local step in a frame, by implementation."""
    table = tables["local_share"]
    rows = []
    for scene, part in table.groupby("scene", sort=False):
        by = part.set_index("implementation")
        cells = []
        for kind in ("interpreted", "numpy", "compiled"):
            row = by.loc[kind]
            total = row.local_ms + row.assembly_ms + row.global_ms
            cells += [format_number(total), format_number(row.local_share)]
        rows.append([name(scene), *cells])
    header = ["scene", "interp.\\ ms", "share", "NumPy ms", "share", "compiled ms", "share"]
    return longtable(header, rows, "lrrrrrr")


_OUTCOMES = ("accurate", "wrong", "left the scene", "blow-up")


def stability(tables: Tables) -> str:
    """Counts of runs by method and outcome: the study's reruns, then those at other settings."""
    table = tables["stability"]
    table = table[(table.outcome != "not run") & ~_full_order(table)]
    rows = []
    for (basis, method), part in table.groupby(["position_basis", "method"], sort=False):
        reruns, sweep = (part[part.experiment == kind] for kind in ("rerun", "sweep"))
        row = [name(method) if basis == "full" else name(f"{method}, {basis} subspace")]
        row += [str((reruns.outcome == outcome).sum()) for outcome in _OUTCOMES]
        row += [format_number(value) for value in (reruns.energy_ratio.median(),
                                                   reruns.energy_ratio.max())]  # fmt: skip
        row += [f"{(sweep.outcome == 'accurate').sum()} of {len(sweep)}"]
        rows.append([*row, format_number(sweep.energy_ratio.max())])
    header = ["method", *_OUTCOMES, "energy (median)", "(max)", "$h$, stiffness: accurate",
              "energy (max)"]  # fmt: skip
    narrow = r">{\raggedleft\arraybackslash}p{1.25cm}"
    return tabular(header, rows, "l" + narrow * 8)


def _full_order(table: pd.DataFrame) -> pd.Series:
    return (table.method == "full") & (table.position_basis == "full")


TEX_TABLES = {
    "tab_claims": claims,
    "tab_claims_in_full": claims_in_full,
    "tab_scenes": scenes,
    "tab_methods": methods,
    "tab_ranks": ranks,
    "tab_reruns": reruns,
    "tab_local_share": local_share,
    "tab_stability": stability,
    "tab_iterations": iterations,
    "tab_positions": positions,
    "tab_break_even": break_even,
    "tab_speedups": speedups,
    "tab_payoff": payoff,
    "tab_pays": pays,
}
