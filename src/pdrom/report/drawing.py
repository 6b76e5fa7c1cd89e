"""Rules of the figures: results -> PDF and PNG."""

from typing import Any

from pdrom.report.figures.output import make_figure
from pdrom.report.figures.sources import Holdings, Sources
from pdrom.report.figures.spec import FigureSpec


def draw(
    name: str,
    spec: dict[str, Any],
    holdings: dict[str, Any],
    results: str,
    published: str,
    pdf: str,
    png: str,
) -> None:
    """Draw figure ``name`` from the results of this configuration."""
    sources = Sources(results, Holdings.model_validate(holdings), published)
    make_figure(name, sources, FigureSpec.model_validate(spec), pdf, png)
