"""How many variations of a claim's rules change its verdict."""

from matplotlib.figure import Figure

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.counts import draw_counts
from pdrom.report.figures.kit.options import Options
from pdrom.report.figures.kit.results import NothingToDraw, Results
from pdrom.tables.claims.sensitivity import VARIED

COLUMNS = ["claim", "part", "varied", "variation", "verdict_of_rules", "same"]
PANELS = {"published": "as published", "beyond": "beyond"}


def draw(results: Results, options: Options) -> Figure:
    """Two panels of cells; StorageError if the table is missing or lacks a column."""
    table = results.table("claims_sensitivity", COLUMNS)
    if table.empty:
        raise NothingToDraw("no verdict")
    claims = list(dict.fromkeys(table.claim))
    height = 0.24 * len(claims) + 0.9
    figure = Figure(figsize=(style.WIDTH, height), layout="constrained")
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
        draw_counts(ax, names, VARIED, cells)
        ax.tick_params(axis="x", labelsize=6.5)
        ax.tick_params(axis="y", labelsize=6.5)
        ax.set_title(title)
        ax.set_xlabel("what is changed")
    panels[0].set_ylabel("claim and verdict")
    return figure
