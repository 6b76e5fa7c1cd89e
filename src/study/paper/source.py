r"""TeX source of the manuscript; folder `OWN` has a short variant for scenes of a user."""

import re
from pathlib import Path

from pdrom.core.errors import PaperError
from study.paper.numbers import NUMBERS_FILE

DOCUMENTS = ("main", "supplement")
SUPPLEMENT = "S"  # prefix of the figure numbers in the supplement
OWN = "paper/own"
PLACED = re.compile(r"\\figureof\{(\w+)\}")
COMMENT = re.compile(r"(?m)^[ \t]*%.*\n|(?<!\\)%.*$")
_PART = re.compile(r"\\input\{((?:sections/|supplement/|preamble)[^{}]*\.tex)\}")


def whole_source(document: Path) -> str:
    r"""Read a document, with preamble and sections in place of its ``\input`` commands.

    Raises PaperError if an included file is missing.
    """

    def part(match: re.Match[str]) -> str:
        for folder in document.parents[:2]:  # documents in `OWN` use the preamble one folder above
            if (path := folder / match[1]).is_file():
                return path.read_text(encoding="utf-8")
        raise PaperError(f"{document}: no file {document.parent / match[1]}")

    return _PART.sub(part, document.read_text(encoding="utf-8"))


def documents(folder: Path) -> dict[str, str]:
    """Map each document of the manuscript in ``folder`` to its source with all sections."""
    return {name: whole_source(folder / f"{name}.tex") for name in DOCUMENTS}


def figure_numbers(root: Path) -> dict[str, str]:
    """Map each figure of the manuscript below ``root`` to its number, such as "3" or "S7".

    Raises PaperError if a file of the source is missing.
    """
    counted: dict[str, str] = {}
    for prefix, source in zip(("", SUPPLEMENT), documents(root / "paper").values(), strict=True):
        placed = PLACED.findall(COMMENT.sub("", source))
        counted |= {name: f"{prefix}{number}" for number, name in enumerate(placed, 1)}
    return counted


def source_files(root: Path, own: bool = False) -> list[str]:
    """List the manuscript's files, relative to ``root``: documents, preamble, numbers, parts.

    If ``own``, the documents are the short variants for scenes of a user, without section files.
    """
    folder = root / "paper"
    files = [(root / OWN if own else folder) / f"{name}.tex" for name in DOCUMENTS]
    files += [folder / "preamble.tex", folder / NUMBERS_FILE]
    for below in () if own else ("sections", "supplement"):
        files += sorted((folder / below).glob("*.tex"))
    return [path.relative_to(root).as_posix() for path in files]
