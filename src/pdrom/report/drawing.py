"""Rule of a figure: results -> PDF and PNG."""

from dataclasses import replace
from pathlib import Path

from pydantic import BaseModel, ConfigDict, JsonValue

from pdrom.core.artifact import Artifact
from pdrom.core.paths import FIGURE, FIGURE_PICTURE, File
from pdrom.core.reads import Given, Setting
from pdrom.report.figures.kit.catalogue import declaration
from pdrom.report.figures.kit.holdings import Holdings
from pdrom.report.figures.kit.results import Results


class Order(BaseModel):
    """What a job is told to draw: the figure, its options, and what the configuration holds.

    published : folder with the published code's output, None where none of it is drawn
    full : whether the configuration is that of the full study
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    title: str
    options: dict[str, JsonValue]
    holdings: Holdings
    settings: dict[str, float]
    published: str | None
    full: bool


def draw(order: Order, results: str, pdf: str, png: str) -> None:
    """Draw a figure from the results of a configuration and write both of its files."""
    # late: whoever plans gives orders only and needs no plotting library
    from pdrom.report.figures.kit.output import draw_figure, write_figure

    options = declaration(order.name).options.model_validate(order.options)
    published = Path(order.published) if order.published else None
    read = Results(results, order.holdings, order.settings, published)
    write_figure(draw_figure(order.name, read, options, order.full), order.title, pdf, png)


def figure(files: list[str], order: Order, pdf: File, png: File) -> None:
    """Draw the figure that ``order`` names; ``files`` are those that it reads."""
    draw(order, str(Path(pdf.path).parents[1]), pdf.path, png.path)


class _Figure(Artifact):
    """One function draws every figure."""

    @property
    def rule(self) -> str:
        """Name of the rule that makes it."""
        return f"figure_{self.name}"

    @property
    def address(self) -> str:
        """Place of `ANY_FIGURE`."""
        return f"{self.module}:ANY_FIGURE"


ANY_FIGURE = _Figure(
    "figure",
    "Figure",
    reads={"files": Given(), "order": Setting("order")},
    writes={"pdf": FIGURE, "png": FIGURE_PICTURE},
    function=figure,
)


def drawn(name: str) -> Artifact:
    """Figure ``name`` as an artifact."""
    places = {kind: place.where(name=name) for kind, place in ANY_FIGURE.writes.items()}
    return replace(ANY_FIGURE, name=name, title=f"Figure {name}", writes=places)
