"""Tables of the manuscript about what accuracy costs, as TeX, made of ``tables``."""

from collections.abc import Callable, Mapping

import pandas as pd

from pdrom.view.text import escape
from study.paper.macros import format_number
from study.paper.tabular import name, tabular
from study.tables.kit.held_out import MEDIAN, over_motions, trained

Tables = Mapping[str, pd.DataFrame]
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
                lambda run: _with_time(run.relative_error_within_horizon, run.ms_per_frame),
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


_EXPONENTS = (
    ("fom", "exponent"), ("fom", "local_exponent"), ("fom", "global_exponent"),
    ("block-deim", "exponent"), ("ecsw", "exponent"),
)  # fmt: skip


def exponents(tables: Tables) -> str:
    """Powers of the number of vertices with which times grow."""
    rows = []
    for scene, part in tables["scaling"].groupby("scene", sort=False):
        curves = part.dropna(subset=["exponent"]).drop_duplicates("method")
        if len(curves):
            found = (_rows(curves, method=m)[column].dropna() for m, column in _EXPONENTS)
            cells = (format_number(own.iloc[0]) if len(own) else NONE for own in found)
            rows.append([name(scene), str(int(curves.meshes.max())), *cells])
    header = [
        "scene", "meshes", "full order", "its local step", "its solve", "block DEIM",
        "sampled subspace",
    ]  # fmt: skip
    return tabular(header, rows, "lr" + "r" * len(_EXPONENTS))


def _rows(table: pd.DataFrame, **wanted: object) -> pd.DataFrame:
    for column, value in wanted.items():
        table = table[table[column] == value]
    return table


def _cell(rows: pd.DataFrame, text: Callable[[pd.Series], str]) -> str:
    """Text of the only row; nothing where there is none."""
    return text(rows.iloc[0]) if len(rows) else NONE


def _with_time(error: float, ms: float) -> str:
    return f"{format_number(error)} ({format_number(ms)})"
