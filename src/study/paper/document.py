"""The list of figures for readers of results."""

import re
from pathlib import Path

from study.artifact.markup import to_plain
from study.artifact.reads import Every, ProjectFile, Read, TableOf
from study.figures.kit.declaration import declarations
from study.paper.figure_numbers import figure_numbers

HEAD = """\
# Figures

`./reproduce figure NAME` draws a figure to `results/figures/NAME.pdf` and `.png`.
The name may be replaced by the figure's number in `main.pdf` (`figure 5`) or in `supplement.pdf`
(`figure S7`), or by the number of the figure of the preprint that it rebuilds
(`figure preprint:8`).
The keys given here choose in `config/figures.yaml` what it shows.
"""


def figures_page(root: Path = Path()) -> str:
    """All figures as Markdown, with numbers by the manuscript below ``root``."""
    parts = [HEAD]
    numbers = figure_numbers(root)
    for name, figure in declarations().items():
        number = f" ({numbers[name].words})" if numbers[name].words else ""
        keys = ", ".join(f"`{key}`" for key in figure.options.model_fields)
        read = filter(None, map(_words, figure.reads.values()))
        parts.append(
            f"## `{name}`{number}\n\n**{_text(figure.title)}.**\n{_lines(figure.caption)}\n\n"
            f"Keys: {keys}.\nReads: {', '.join(dict.fromkeys(read))}.\n"
        )
    return "\n".join(parts)


def _lines(caption: str) -> str:
    """Caption with one sentence a line."""
    return re.sub(r"\. (?=[A-Z`])", ".\n", _text(caption))


def _text(marked: str) -> str:
    """Mark-up for this page: names in typewriter, settings by their key."""
    plain = re.sub(r"\{([a-z_.]+)\}", r"@\1@", marked)
    pieces = re.split(r"(`[^`]*`)", plain)
    words = "".join(p if p.startswith("`") else to_plain(p) for p in pieces)
    return re.sub(r"@([a-z_.]+)@", r"`\1`", words)


def _words(read: Read) -> str | None:
    """Words for a table or files that are read; None for settings."""
    match read:
        case TableOf():
            return f"table `{read.name}`"
        case Every():
            return f"`{read.place.pattern}`"
        case ProjectFile():
            return f"`{read.path}`"
    return None
