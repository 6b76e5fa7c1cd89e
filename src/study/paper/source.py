r"""TeX source of the manuscript; folder `OWN` has a short variant for a user's own scenes."""

import re
from pathlib import Path
from typing import NamedTuple

from pdrom.core.errors import PaperError
from study.artifact.markup import to_plain
from study.artifact.reads import Every, ProjectFile, Read, TableOf
from study.figures.kit.declaration import declarations

DOCUMENTS = ("main", "supplement")
OWN = "paper/own"
FIGURE = re.compile(r"\\figureof\{(\w+)\}")
COMMENT = re.compile(r"(?m)^[ \t]*%.*\n|(?<!\\)%.*$")
_PART = re.compile(r"\\input\{((?:sections/|supplement/|preamble)[^{}]*\.tex)\}")


def whole_source(document: Path) -> str:
    r"""Text of a document; its ``\input`` commands are replaced by preamble and sections.

    Raises PaperError if an included file is missing.
    """

    def part(match: re.Match[str]) -> str:
        for folder in document.parents[:2]:  # documents in `OWN` use the preamble one folder above
            if (path := folder / match[1]).is_file():
                return path.read_text(encoding="utf-8")
        raise PaperError(f"{document}: no file {document.parent / match[1]}")

    return _PART.sub(part, document.read_text(encoding="utf-8"))


def documents(folder: Path) -> dict[str, str]:
    """Map each document of the manuscript in ``folder`` to its source text with all sections."""
    return {name: whole_source(folder / f"{name}.tex") for name in DOCUMENTS}


def source_files(root: Path, own: bool = False) -> list[str]:
    """Paths of the manuscript's TeX files, relative to ``root``: documents, preamble, sections.

    If ``own``, the documents are the short ones about a user's own scenes, without section files.
    """
    folder = root / "paper"
    files = [(root / OWN if own else folder) / f"{name}.tex" for name in DOCUMENTS]
    files.append(folder / "preamble.tex")
    for below in () if own else ("sections", "supplement"):
        files += sorted((folder / below).glob("*.tex"))
    return [path.relative_to(root).as_posix() for path in files]


SUPPLEMENT = "S"  # prefix of the figure numbers in the supplement


class Numbers(NamedTuple):
    """Numbers of a figure in the manuscript and in the preprint; None where it does not occur.

    The number in the manuscript is "3" in the paper, "S7" in the supplement.
    """

    manuscript: str | None
    preprint: int | None

    @property
    def words(self) -> str:
        """The figure's numbers: "figure S10 of supplement.pdf, figure 8 of the preprint"."""
        own = self.manuscript or ""
        document = "supplement.pdf" if own.startswith(SUPPLEMENT) else "main.pdf"
        places = {document: self.manuscript, "the preprint": self.preprint}
        return ", ".join(f"figure {n} of {place}" for place, n in places.items() if n is not None)

    def label(self, name: str) -> str:
        """Return the figure's ``name`` and, if it has any, its numbers (`words`) in parentheses."""
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
