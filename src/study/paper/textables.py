"""Tables of the manuscript as TeX, generated from ``tables`` of the study by name."""

import re
from collections.abc import Mapping
from typing import Any

import pandas as pd

from pdrom.view.text import escape
from study.paper.claim_tables import claims, claims_in_full
from study.paper.cost_tables import break_even, exponents, iterations, positions
from study.paper.hard_tables import hard_cases, hard_reductions
from study.paper.macros import format_number
from study.paper.speedup_tables import payoff, pays, speedups
from study.paper.tabular import longtable, name, tabular
from study.tables.kit.held_out import trained

Tables = Mapping[str, pd.DataFrame]


def scenes(tables: Tables) -> str:
    """Scenes with their groups, sizes and horizons."""
    horizon = trained(tables["reduced_reruns"]).groupby("scene").horizon_frame.first()
    rows = []
    for row in tables["scenes"].itertuples():
        end = horizon.get(row.scene)
        shown = "--" if pd.isna(end) else "run" if end == row.frames else str(int(end))
        groups = _powers(escape(row.groups.replace("_", " ")))
        rows.append(
            [name(row.scene), groups, str(row.vertices), str(row.elements), str(row.frames), shown]
        )
    header = ["scene", "groups (weight)", "vertices", "elements", "frames", "horizon"]
    return longtable(header, rows, r"l>{\raggedright\arraybackslash}p{5.2cm}rrrr")


def _powers(text: str) -> str:
    """Numbers such as 1e+06 in ``text`` as powers of ten."""
    plain = re.sub(r"([\d.]+)e\+?(-?)0*(\d+)", r"$\1\\cdot 10^{\2\3}$", text)
    return plain.replace(r"$1\cdot 10", "$10")


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
        decay = [_relative(real, component) for component in (6, 10, 20)]
        rows.append([name(scene), escape(group.replace("_", " ")), str(len(real)), *decay])
    header = ["scene", "group", "rank", r"$\sigma_6/\sigma_1$", r"$\sigma_{10}/\sigma_1$",
              r"$\sigma_{20}/\sigma_1$"]  # fmt: skip
    return longtable(header, rows, "llrrrr")


def _relative(rows: pd.DataFrame, component: int) -> str:
    cell = rows[rows.component == component].relative
    return format_number(cell.iloc[0]) if len(cell) else "--"


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
    "tab_exponents": exponents,
    "tab_speedups": speedups,
    "tab_payoff": payoff,
    "tab_pays": pays,
    "tab_hard_cases": hard_cases,
    "tab_hard_reductions": hard_reductions,
}
