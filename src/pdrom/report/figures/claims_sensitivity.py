"""Verdicts that change with their rules."""

from pdrom.artifact.reads import TableOf
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.artists import Figure
from pdrom.report.figures.kit.counts import draw_counts
from pdrom.report.figures.kit.declaration import figure
from pdrom.report.figures.kit.options import Options
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.claims.sensitivity import VARIED

PANELS = {"published": "as published", "beyond": "beyond"}


@figure(
    title="Fragile verdicts",
    caption=(
        "Verdicts on the claims, as published and beyond, when their rules change: each cell holds "
        "the variations that give another verdict, of all of this kind. Thresholds are multiplied "
        "by factors from a half to two, the share of rows that must agree goes from a half to one, "
        "the margin within which ratios of times decide nothing from none to a factor five, "
        "sizes are the small or the large ones only, splits the training frames, those between "
        "them or the held-out ones, and scenes are left out one at a time. An empty cell: the "
        "variation does not exist. A row without colour is a verdict that does not hang on its "
        "rule."
    ),
    reads=(TableOf("claims_sensitivity"),),
    options=Options,
)
def claims_sensitivity(results: Results, options: Options) -> Figure:
    """Draw two panels of cells."""
    table = results.table("claims_sensitivity")
    if table.empty:
        raise NothingToDraw("no verdict")
    claims = list(dict.fromkeys(table.claim))
    figure = style.new_figure(0.24 * len(claims) + 0.9)
    panels = figure.subplots(1, len(PANELS), squeeze=False)[0]
    for ax, (part, title) in zip(panels, PANELS.items(), strict=True):
        rows = table[table.part == part]
        verdicts = rows.drop_duplicates("claim").set_index("claim").verdict_of_rules
        counts = (~rows.same.astype(bool)).groupby([rows.claim, rows.varied]).agg(["sum", "count"])
        cells = {
            (y, x): (int(counts["sum"][claim, kind]), int(counts["count"][claim, kind]))
            for y, claim in enumerate(claims)
            for x, kind in enumerate(VARIED)
            if (claim, kind) in counts.index
        }
        names = [f"{claim} {verdicts.get(claim, 'cannot be decided')}" for claim in claims]
        draw_counts(ax, names, VARIED, cells=cells)
        ax.tick_params(axis="x", labelsize=6.5)
        ax.tick_params(axis="y", labelsize=6.5)
        ax.set_title(title)
        ax.set_xlabel("what is changed")
    panels[0].set_ylabel("claim and verdict")
    return figure
