r"""TeX source of the manuscript; `OWN` is the variant for studies of a user's own scenes."""

import re
from pathlib import Path

from pdrom.core.errors import PaperError

DOCUMENTS = ("main", "supplement")
OWN = "paper/own"
FIGURE = re.compile(r"\\figureof\{(\w+)\}")
COMMENT = re.compile(r"(?m)^[ \t]*%.*\n|(?<!\\)%.*$")
_PART = re.compile(r"\\input\{((?:sections/|supplement/|preamble)[^{}]*\.tex)\}")


def whole_source(document: Path) -> str:
    r"""Text of a document in which preamble and sections replace their ``\input`` commands.

    Raises
    ------
    PaperError
        An included file is missing.
    """

    def part(match: re.Match[str]) -> str:
        for folder in document.parents[:2]:  # documents in `OWN` use the preamble of its parent
            if (path := folder / match[1]).is_file():
                return path.read_text(encoding="utf-8")
        raise PaperError(f"{document}: no file {document.parent / match[1]}")

    return _PART.sub(part, document.read_text(encoding="utf-8"))


def documents(folder: Path) -> dict[str, str]:
    """Source of each document of the manuscript in ``folder``, by name, with its sections."""
    return {name: whole_source(folder / f"{name}.tex") for name in DOCUMENTS}


def source_files(root: Path, own: bool = False) -> list[str]:
    """Paths of TeX files below ``root``, documents and preamble first; ``own``: variant `OWN`."""
    folder = root / "paper"
    files = [(root / OWN if own else folder) / f"{name}.tex" for name in DOCUMENTS]
    files.append(folder / "preamble.tex")
    for below in () if own else ("sections", "supplement"):
        files += sorted((folder / below).glob("*.tex"))
    return [path.relative_to(root).as_posix() for path in files]
