"""What a figure states about itself, once."""

from dataclasses import dataclass

from pdrom.core.reads import Chosen, Every, Published, Setting, TableOf
from pdrom.report.figures.kit.options import Options

FigureRead = TableOf | Chosen | Every | Published | Setting


@dataclass(frozen=True)
class Declaration:
    """A figure. Its name is that of the module that declares it.

    title, caption : in light mark-up (`pdrom.report.words.markup`); ``{key}`` stands for a setting
        of the configuration that the figure reads
    reads : everything that its drawing may read; of `Every` kind of file, those of the scenes and
        groups that its options choose, where the configuration holds them
    options : what a user may choose in config/figures.yaml, with the defaults
    number : number in the preprint that is reproduced; None for a figure of this study
    drawing : module of `drawings` that draws it, where that is not the figure's own name
    """

    title: str
    caption: str
    reads: tuple[FigureRead, ...]
    options: type[Options]
    number: int | None = None
    drawing: str | None = None
