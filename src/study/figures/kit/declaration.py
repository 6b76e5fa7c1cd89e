"""Declaration of a figure: title, caption, inputs, and the function that draws it.

A figure is declared by a decorator on its drawing function in a module of `study.figures`::

    @figure(
        title="Rest shapes",
        caption="Vertices of each mesh.",
        reads={"meshes": EachOf(MESH, "experiments")},
    )
    def rest_shapes(options: Scenes, drawn: Drawn, meshes: list[File]) -> Figure: ...
"""

import logging
import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.store import atomic_path
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.view import style
from pdrom.view.artists import Figure
from study.artifact.artifact import Artifact, declare, declared_in
from study.artifact.markup import filled, to_plain
from study.artifact.paths import FIGURE, FIGURE_PICTURE
from study.artifact.reads import Read, Setting, Settings
from study.figures.kit.options import Drawn, NothingToDraw, Options

log = logging.getLogger(__name__)

PACKAGE = "study.figures"
PNG_DPI = 200
RASTER_DPI = 300  # resolution of rasterised parts of a PDF
ELSEWHERE = "the full study (config/default.yaml) draws it"


@dataclass(frozen=True)
class Declaration(Artifact):
    """Figure of the study, with the name of the function that draws it.

    The function gets its inputs and ``options``, whose type defines the keys and defaults of the
    figure in config/figures.yaml. It raises `NothingToDraw` if the configuration has no data for
    the figure, and StorageError for a damaged file.

    title, caption : text in light mark-up (`study.artifact.markup`); ``{key}`` in a caption names
        a setting of the configuration
    number : number of the reproduced figure in the preprint; None for a figure of this study
    """

    caption: str = ""
    number: int | None = None
    rule_pattern = "figure_{}"

    @property
    def options(self) -> type[Options]:
        """Type of the figure's options, from the annotation of its function."""
        chosen: type[Options] = self.function.__annotations__["options"]
        return chosen

    def words(self, value: Callable[[str], Any]) -> tuple[str, str]:
        """Title and caption in mark-up; ``value`` returns the settings named in the caption.

        Raises
        ------
        ConfigurationError
            If a setting does not exist.
        """
        return self.title, filled(self.caption, value)

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Draw the figure in a workflow job and write it as PDF and PNG."""
        drawn = self.draw(**self.read(settings, inputs))
        write_figure(drawn, to_plain(self.title), outputs["pdf"], png=outputs["png"])

    def draw(self, **read: Any) -> Figure:
        """Draw the figure from its inputs, or a note if they have no data for it.

        Raises
        ------
        StorageError
            If a file is missing or damaged.
        """
        with style.look():
            try:
                return self.function(**read)
            except NothingToDraw as nothing:
                log.info("figure %s: %s", self.name, nothing)
                return style.note(f"no data in this configuration: {nothing}\n{ELSEWHERE}")


def figure(
    *, title: str, caption: str, reads: Mapping[str, Read], number: int | None = None
) -> Callable[[Callable[..., Figure]], Declaration]:
    """Return a decorator that declares a function, called with ``options`` and inputs, as a figure.

    A function with a parameter ``drawn`` also gets the part of the study selected by the options.
    Line breaks in the caption count as blanks.

    Raises
    ------
    TypeError
        If the function's parameters do not match ``reads``.
    """

    def decorate(function: Callable[..., Figure]) -> Declaration:
        name = function.__name__
        writes = {"pdf": FIGURE.where(name=name), "png": FIGURE_PICTURE.where(name=name)}
        drawn = {"drawn": Settings(Drawn)} if "drawn" in function.__annotations__ else {}
        given = {"options": Setting("options"), **drawn, **reads}
        words = " ".join(caption.split())
        made = Declaration(name, title, given, writes, function, caption=words, number=number)
        return declare(made)

    return decorate


def write_figure(
    figure: Figure, title: str, pdf: str | os.PathLike[str], png: str | os.PathLike[str]
) -> None:
    """Write ``figure`` to the files ``pdf`` (embedded TrueType fonts, no dates) and ``png``.

    Both files have ``title`` in their metadata; repeated calls write the same bytes.

    A file appears only when it is complete.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    document = {"Title": title, "Creator": "pdrom", "CreationDate": None, "ModDate": None}
    with style.look():
        with atomic_path(Path(pdf)) as temporary:
            figure.savefig(temporary, format="pdf", dpi=RASTER_DPI, metadata=document)
        with atomic_path(Path(png)) as temporary:
            figure.savefig(temporary, format="png", dpi=PNG_DPI, metadata={"Title": title})


@cache
def declarations() -> dict[str, Declaration]:
    """Return figures by name, first those of the preprint in its order, then the others by name.

    Raises
    ------
    ConfigurationError
        If two figures have the same number.
    """
    found = declared_in(PACKAGE, Declaration)
    numbers = [made.number for made in found.values() if made.number is not None]
    for number in numbers:
        if numbers.count(number) > 1:
            raise ConfigurationError(f"{PACKAGE}: two figures have the number {number}")
    last = len(found) + max(numbers, default=0)
    return dict(sorted(found.items(), key=lambda item: (item[1].number or last, item[0])))


def load_choices(path: Path, known: Mapping[str, Collection[str]]) -> dict[str, Options]:
    """Options of every figure: its defaults, overridden by the file ``path``.

    Parameters
    ----------
    known : option key (scenes, methods) -> names that are allowed in it

    Raises
    ------
    ConfigurationError
        If there is an unknown figure or key, a value outside its range, or a name that is not in
        ``known``.
    """
    content = read_yaml(path)
    content = {} if content is None else content
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path}: a mapping of figure names is required")
    figures = declarations()
    for name in content:
        if name not in figures:
            raise ConfigurationError(f"{path}: unknown figure '{name}'{choices(name, figures)}")
    chosen = {
        name: validate(figure.options, content.get(name, {}), f"{path}: {name}")
        for name, figure in figures.items()
    }
    for name, options in chosen.items():
        for key, allowed in known.items():
            asked = options.names(key)
            for each in (*asked, *options.names("published")) if key == "scenes" else asked:
                if each not in allowed:
                    place = f"{path}: {name}.{key} = '{each}'"
                    raise ConfigurationError(f"{place}: unknown{choices(each, allowed)}")
    return chosen
