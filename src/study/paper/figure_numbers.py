"""Numbers of the figures in paper, supplement and preprint; a page that lists all figures."""

import re
from pathlib import Path
from typing import NamedTuple

from study.artifact.markup import to_plain
from study.artifact.reads import Every, ProjectFile, Read, TableOf
from study.figures.kit.declaration import declarations
from study.paper.source import COMMENT, FIGURE, documents

SUPPLEMENT = "S"  # prefix of the figure numbers in the supplement


class Numbers(NamedTuple):
    """Numbers of a figure in the manuscript and in the preprint; None where it does not occur.

    The number in the manuscript is "3" in the paper, "S7" in the supplement.
    """

    manuscript: str | None
    preprint: int | None

    @property
    def words(self) -> str:
        """Both numbers in words, as in "figure S10 of supplement.pdf, figure 8 of the preprint"."""
        own = self.manuscript or ""
        document = "supplement.pdf" if own.startswith(SUPPLEMENT) else "main.pdf"
        places = {document: self.manuscript, "the preprint": self.preprint}
        return ", ".join(f"figure {n} of {place}" for place, n in places.items() if n is not None)

    def label(self, name: str) -> str:
        """Return ``name``, the figure's name, followed by its numbers if it has any."""
        return f"{name} ({self.words})" if self.words else name


def figure_numbers(root: Path) -> dict[str, Numbers]:
    """Return name of a figure -> its numbers, from the manuscript's source below ``root``.

    Raises PaperError if a file of the source is missing.
    """
    counted: dict[str, str] = {}
    for prefix, source in zip(("", SUPPLEMENT), documents(root / "paper").values(), strict=True):
        placed = FIGURE.findall(COMMENT.sub("", source))
        counted |= {name: f"{prefix}{number}" for number, name in enumerate(placed, 1)}
    return {name: Numbers(counted.get(name), f.number) for name, f in declarations().items()}


HEAD = """\
# Figures

`./reproduce figure NAME` draws a figure to `results/figures/NAME.pdf` and `.png`.
The name may be replaced by the figure's number in `main.pdf` (`figure 5`) or in `supplement.pdf`
(`figure S7`), or by the number of the figure of the preprint that it rebuilds
(`figure preprint:8`).
The keys given here choose in `config/figures.yaml` what it shows.
"""


def figures_page(root: Path = Path()) -> str:
    """Markdown page about all figures, with their numbers; the manuscript is below ``root``."""
    parts = [HEAD]
    numbers = figure_numbers(root)
    for name, figure in declarations().items():
        keys = ", ".join(f"`{key}`" for key in figure.options.model_fields)
        read = filter(None, map(_words, figure.reads.values()))
        caption = re.sub(r"\. (?=[A-Z`])", ".\n", _text(figure.caption))  # a line per sentence
        parts.append(
            f"## {numbers[name].label(f'`{name}`')}\n\n**{_text(figure.title)}.**\n{caption}\n\n"
            f"Keys: {keys}.\nReads: {', '.join(dict.fromkeys(read))}.\n"
        )
    return "\n".join(parts)


def _text(marked: str) -> str:
    """Convert a title or caption from mark-up to Markdown; ``{key}`` of a setting becomes `key`."""
    plain = re.sub(r"\{([a-z_.]+)\}", r"@\1@", marked)
    pieces = re.split(r"(`[^`]*`)", plain)
    words = "".join(p if p.startswith("`") else to_plain(p) for p in pieces)
    return re.sub(r"@([a-z_.]+)@", r"`\1`", words)


def _words(read: Read) -> str | None:
    """Return the name of the table or files that ``read`` declares as input; None for a setting."""
    match read:
        case TableOf():
            return f"table `{read.name}`"
        case Every():
            return f"`{read.place.pattern}`"
        case ProjectFile():
            return f"`{read.path}`"
    return None
