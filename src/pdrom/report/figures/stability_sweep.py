"""Outcomes of each method over the time step and over the stiffness."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Axes, Figure
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.options import Methods, Scenes
from pdrom.report.figures.kit.outcomes import Block, draw_cells, legend
from pdrom.report.figures.kit.results import NothingToDraw, Results

ROW = 0.15  # inches


@dataclass(frozen=True)
class _Model:
    """Model of a row of the picture."""

    method: str
    position_basis: str
    size: int | None

    @property
    def label(self) -> str:
        """Words for the row."""
        if self.position_basis == "full":
            return "full order" if self.size is None else f"{self.method}, r = {self.size}"
        tail = "" if self.method == "full" else f", {self.method}"
        return f"{self.position_basis} subspace{tail}, k = {self.size}"


class Options(Scenes, Methods):
    """Choices."""


@figure(
    title="Time step and stiffness",
    caption=(
        "How short runs at other time steps and with other weights of the reduced group ended. "
        "Bases and samplings are those of the scene's own setting, marked by a triangle; the "
        "full-order run that each is compared with has the same setting."
    ),
    reads=(TableOf("stability"),),
    options=Options,
)
def stability_sweep(results: Results, options: Options) -> Figure:
    """Draw the time step above, the stiffness below: a block per scene, a row per method.

    Bases and samplings are those of the scene's own setting, which is marked by an arrow head.
    """
    table = results.asked_rows("stability", options)
    table = table[table.experiment == "sweep"]
    if table.empty:
        raise NothingToDraw("no run over time step and stiffness")
    table = table.assign(model=[_model(row) for row in table.itertuples()])
    models = list(dict.fromkeys(table.model))
    figure = style.new_figure(2 * (ROW * len(models) + 0.5) + 0.45)
    upper, lower = figure.subplots(2, 1)
    own = _own_steps(table)
    steps = table[table.stiffness_ratio == 1.0]
    _panel(upper, steps, models, "h", own, lambda h: f"{1e3 * h:g}")
    upper.set_xlabel("time step h (ms)", fontsize=7)
    at_own = table[table.h == table.scene.map(own)]
    ones = dict.fromkeys(own, 1.0)
    _panel(lower, at_own, models, "stiffness_ratio", ones, _power)
    lower.set_xlabel("weight of the reduced group over the trained one", fontsize=7)
    legend(figure, list(table.outcome.unique()))
    return figure


def _model(row: Any) -> _Model:
    size = row.r if row.position_basis == "full" else row.k
    return _Model(row.method, row.position_basis, None if pd.isna(size) else int(size))


def _own_steps(table: pd.DataFrame) -> dict[str, float]:
    """The scenes' own time steps: the one at which the stiffness is varied, else the only one."""
    steps = {}
    for scene, rows in table.groupby("scene", sort=False):
        varied = rows[rows.stiffness_ratio != 1.0].h
        steps[str(scene)] = float((varied if len(varied) else rows.h).iloc[0])
    return steps


def _panel(
    ax: Axes,
    rows: pd.DataFrame,
    models: Sequence[_Model],
    column: str,
    own: Mapping[str, float],
    text: Callable[[float], str],
) -> None:
    """One quantity: blocks of scenes (and groups, where a scene reduces several)."""
    blocks, cells = [], []
    for (scene, group), title in _experiments(rows).items():
        mine = rows[(rows.scene == scene) & (rows.group.isin([group, "all"]) | rows.group.isna())]
        values = sorted(mine[column].unique())
        labels = [text(v) + ("\n\N{BLACK UP-POINTING TRIANGLE}" if v == own[scene] else "")
                  for v in values]  # fmt: skip
        blocks.append(Block(title, labels))
        known = {(row.model, getattr(row, column)): row for _, row in mine.iterrows()}
        cells.append((values, known))

    def cell(i: int, j: int, k: int) -> pd.Series | None:
        values, known = cells[j]
        return known.get((models[i], values[k]))

    draw_cells(ax, [model.label for model in models], blocks, cell=cell)
    ax.set_ylabel("method", fontsize=7)


def _experiments(rows: pd.DataFrame) -> dict[tuple[str, str], str]:
    """(scene, group) -> title; the group is named only where there are several."""
    local = rows[rows.group.notna() & (rows.group != "all")]
    pairs = list(dict.fromkeys(zip(local.scene, local.group, strict=True)))
    pairs += [(scene, "all") for scene in dict.fromkeys(rows.scene) if scene not in dict(pairs)]
    several = pd.Series([scene for scene, _ in pairs]).value_counts()
    return {
        (scene, group): style.words(scene if several[scene] == 1 else f"{scene}: {group}")
        for scene, group in pairs
    }


def _power(ratio: float) -> str:
    exponent = f"{ratio:e}".split("e")
    if float(exponent[0]) == 1.0:
        return f"$10^{{{int(exponent[1])}}}$" if ratio != 1.0 else "1"
    return f"{ratio:g}"
