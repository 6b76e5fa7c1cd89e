"""Declaration of a figure: title, caption, reads, and the function that draws it.

A module of `study.figures` holds one figure, a function under its declaration::

    @figure(
        title="Rest shapes",
        caption="Vertices of each mesh.",
        reads=(Chosen(MESH),),
        options=Scenes,
    )
    def rest_shapes(results: Results, options: Scenes) -> Figure: ...
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, JsonValue

from pdrom.view.artists import Figure
from study.artifact.artifact import Artifact
from study.artifact.paths import FIGURE, FIGURE_PICTURE, TABLE
from study.artifact.reads import Chosen, Every, Published, Setting, TableOf
from study.figures.kit.holdings import Holdings
from study.figures.kit.options import Options
from study.figures.kit.results import Results

FigureRead = TableOf | Chosen | Every | Published | Setting
OptionsT = TypeVar("OptionsT", bound=Options)


class Order(BaseModel):
    """Settings of a drawing: the figure's title and options, and the contents of the configuration.

    published : folder with the published code's output, None where none of it is drawn
    full : whether the configuration is that of the full study
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str
    options: dict[str, JsonValue]
    holdings: Holdings
    settings: dict[str, float]
    published: str | None
    full: bool


@dataclass(frozen=True)
class Declaration(Artifact):
    """A figure, named as the function that draws it.

    The function gets the ``results`` of the study and its own ``options``. It raises
    `NothingToDraw` where the configuration holds nothing of what the figure shows, StorageError
    for a file that is missing or damaged.

    title, caption : in light mark-up (`study.artifact.markup`); ``{key}`` stands for a setting
        of the configuration that the figure reads
    reads : everything that its function may read; of `Every` kind of file, those of the scenes and
        groups that its options choose, where the configuration holds them
    options : what a user may choose in config/figures.yaml, with the defaults
    number : number in the preprint that is reproduced; None for a figure of this study
    """

    caption: str = ""
    options: type[Options] = Options
    number: int | None = None

    @property
    def rule(self) -> str:
        """Name of the rule that makes it."""
        return f"figure_{self.name}"

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Draw the figure in a job and write both of its files."""
        # imported late: a plan needs no plotting library
        from study.figures.kit.output import draw_figure, write_figure

        order = Order.model_validate(settings["order"])
        published = Path(order.published) if order.published else None
        read = Results(self._folder(inputs), order.holdings, order.settings, published=published)
        drawn = draw_figure(self, read, self.options.model_validate(order.options), full=order.full)
        write_figure(drawn, order.title, outputs["pdf"], png=outputs["png"])

    def _folder(self, inputs: Mapping[str, Any]) -> str:
        """Folder of the results, which the inputs lie in; empty without any."""
        for name, read in self.files.items():
            paths = [inputs[name]] if isinstance(inputs[name], str) else list(inputs[name])
            place = TABLE if isinstance(read, TableOf) else getattr(read, "place", None)
            if paths and place is not None:
                return str(Path(paths[0]).parents[place.pattern.count("/")])
        return ""


def figure(
    *,
    title: str,
    caption: str,
    reads: tuple[FigureRead, ...],
    options: type[OptionsT],
    number: int | None = None,
) -> Callable[[Callable[[Results, OptionsT], Figure]], Declaration]:
    """Declare the function below as a figure."""

    def declare(function: Callable[[Results, OptionsT], Figure]) -> Declaration:
        name = function.__name__
        writes = {"pdf": FIGURE.where(name=name), "png": FIGURE_PICTURE.where(name=name)}
        named = {f"read{i}": read for i, read in enumerate(reads)}
        return Declaration(
            name, title, named, writes, function, caption=caption, options=options, number=number
        )

    return declare
