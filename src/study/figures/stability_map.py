"""The stability map: how every reduced run of the study ended."""

from dataclasses import dataclass

import pandas as pd

from pdrom.view import style
from pdrom.view.artists import Figure
from study.artifact.reads import Setting, TableOf
from study.figures.kit.declaration import figure
from study.figures.kit.options import Experiments, Methods, Ranks
from study.figures.kit.outcomes import Block, draw_cells, legend
from study.figures.kit.results import NothingToDraw, Results

CELLS = 48  # of one strip; more blocks make another strip
ROW = 0.145  # inches


class Options(Experiments, Methods, Ranks):
    """Choices."""


@figure(
    title="Where each method can be trusted",
    caption=(
        "How every run on the training motion ended, by method, size and scene. Accurate or "
        "wrong: the error within the horizon is at most, or above, {stability.wrong}; left the "
        "scene: the bounding box exceeds {stability.left} times the largest one of the full-order "
        "run; blow-up: numbers that are not finite, or an extent beyond the limit, in the printed "
        "frame. Groups whose projections are round-off are left out."
    ),
    reads=(TableOf("stability"), Setting("stability.wrong"), Setting("stability.left")),
    options=Options,
)
def stability_map(results: Results, options: Options) -> Figure:
    """Draw strips of blocks: a block per method, its columns are sizes; a row per experiment.

    Runs with unreduced positions come first, then those in position subspaces. Experiments in which
    nothing ran, because their projections are round-off, are left out.
    """
    table = results.asked_rows("stability", options)
    table = table[(table.experiment == "rerun") & (table.group.notna())]
    strips = _local_strips(table, results, options) + _subspace_strips(table)
    if not strips:
        raise NothingToDraw("no reduced run")
    rows = [len(strip.rows) for strip in strips]
    figure = style.new_figure(ROW * sum(rows) + 0.5 * len(strips) + 0.55)
    axes = figure.subplots(len(strips), 1, squeeze=False, height_ratios=rows)[:, 0]
    for ax, strip in zip(axes, strips, strict=True):
        draw_cells(ax, list(strip.rows.values()), strip.blocks, cell=strip.cell)
        ax.set_xlabel(strip.xlabel, fontsize=7)
        ax.set_ylabel("scene", fontsize=7)
    legend(figure, list({o for strip in strips for o in strip.outcomes()}))
    return figure


@dataclass(frozen=True)
class _Strip:
    """A strip of the map: blocks of columns side by side that share their rows.

    rows : (scene, group) -> label
    lookups : for each block the (scene, group) -> rows of the table, by column
    """

    rows: dict[tuple[str, str], str]
    blocks: list[Block]
    lookups: list[list[dict[tuple[str, str], pd.Series]]]
    xlabel: str

    def cell(self, row: int, block: int, column: int) -> pd.Series | None:
        """Row of the table for a cell."""
        return self.lookups[block][column].get(list(self.rows)[row])

    def outcomes(self) -> set[str]:
        """Outcomes that occur."""
        found = [column.get(key) for block in self.lookups for column in block for key in self.rows]
        return {str(cell.outcome) for cell in found if cell is not None}


def _local_strips(table: pd.DataFrame, results: Results, options: Options) -> list[_Strip]:
    part = table[table.position_basis == "full"]
    ran = part[part.outcome != "not run"]
    held = set(zip(ran.scene, ran.group, strict=True))
    pairs = [p for p in results.experiments(options) if p in held]
    rows = {(scene, group): results.experiment_title(scene, group) for scene, group in pairs}
    ranks = [r for r in options.ranks if r == "full" or r in set(part.r)]
    blocks, lookups = [], []
    for method in dict.fromkeys(part.method):
        own = part[part.method == method]
        blocks.append(Block(method, [str(r) for r in ranks]))
        lookups.append([_by_experiment(_at_size(own, r)) for r in ranks])
    return _wrapped(rows, blocks, lookups, "number of modes r (full: numerical rank)")


def _subspace_strips(table: pd.DataFrame) -> list[_Strip]:
    part = table[table.position_basis != "full"]
    rows = {(scene, "all"): style.words(scene) for scene in dict.fromkeys(part.scene)}
    blocks, lookups = [], []
    for basis, method in dict.fromkeys(zip(part.position_basis, part.method, strict=True)):
        own = part[(part.position_basis == basis) & (part.method == method)]
        sizes = sorted(own.k.dropna().unique())
        sampled = "all" if method == "full" else method
        blocks.append(Block(f"{basis}\n{sampled}", [str(int(k)) for k in sizes]))
        lookups.append([_by_experiment(own[own.k == k]) for k in sizes])
    return _wrapped(
        rows, blocks, lookups, "number of modes k of the position subspace (all: all projections)"
    )


def _wrapped(rows: dict, blocks: list[Block], lookups: list, xlabel: str) -> list[_Strip]:
    """Strips of at most `CELLS` cells."""
    if not rows or not blocks:
        return []
    strips, start, used = [], 0, 0
    for i, block in enumerate(blocks):
        if used and used + len(block.labels) > CELLS:
            strips.append(_Strip(rows, blocks[start:i], lookups[start:i], xlabel))
            start, used = i, 0
        used += len(block.labels)
    return [*strips, _Strip(rows, blocks[start:], lookups[start:], xlabel)]


def _at_size(rows: pd.DataFrame, size: int | str) -> pd.DataFrame:
    """Runs of a size; "full" is the largest one that ran in each experiment."""
    if size != "full":
        return rows[rows.r == size]
    ran = rows[rows.outcome != "not run"].sort_values("r", kind="stable")
    return ran.groupby(["scene", "group"], sort=False).tail(1)


def _by_experiment(rows: pd.DataFrame) -> dict[tuple[str, str], pd.Series]:
    return {(row.scene, row.group): row for _, row in rows.iterrows()}
