"""What a figure says of itself: title, caption, what it reads, and the function that draws it.

A module of `pdrom.report.figures` holds one figure, a function under its declaration::

    @figure(
        title="Rest shapes",
        caption="Vertices of each mesh.",
        reads=(Chosen(MESH),),
        options=Scenes,
    )
    def rest_shapes(results: Results, options: Scenes) -> Figure: ...
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from pdrom.core.reads import Chosen, Every, Published, Setting, TableOf
from pdrom.report.figures.kit.artists import Figure
from pdrom.report.figures.kit.options import Options
from pdrom.report.figures.kit.results import Results

FigureRead = TableOf | Chosen | Every | Published | Setting
OptionsT = TypeVar("OptionsT", bound=Options)


@dataclass(frozen=True)
class Declaration:
    """A figure, named as the function that draws it.

    title, caption : in light mark-up (`pdrom.report.words.markup`); ``{key}`` stands for a setting
        of the configuration that the figure reads
    reads : everything that its function may read; of `Every` kind of file, those of the scenes and
        groups that its options choose, where the configuration holds them
    options : what a user may choose in config/figures.yaml, with the defaults
    number : number in the preprint that is reproduced; None for a figure of this study
    function : draws it; raises `NothingToDraw` where the configuration holds nothing of what it
        shows, StorageError for a file that is missing or damaged or a table that lacks a column
    """

    name: str
    title: str
    caption: str
    reads: tuple[FigureRead, ...]
    options: type[Options]
    number: int | None
    function: Callable[[Results, Any], Figure]

    @property
    def module(self) -> str:
        """Module that draws the figure."""
        return self.function.__module__


def figure(
    *,
    title: str,
    caption: str,
    reads: tuple[FigureRead, ...],
    options: type[OptionsT],
    number: int | None = None,
) -> Callable[[Callable[[Results, OptionsT], Figure]], Declaration]:
    """Declare the function below as a figure, see `Declaration`."""

    def declare(function: Callable[[Results, OptionsT], Figure]) -> Declaration:
        name = function.__name__
        return Declaration(name, title, caption, reads, options, number, function)

    return declare
