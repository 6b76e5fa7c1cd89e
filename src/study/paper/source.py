r"""The manuscript's source: two documents, the paper and its supplement, with a file a section."""

import re
from pathlib import Path

from pdrom.core.errors import PaperError

DOCUMENTS = ("main", "supplement")
_PART = re.compile(r"\\input\{((?:sections/|supplement/|preamble)[^{}]*\.tex)\}")


def whole_source(document: Path) -> str:
    r"""Text of a document with preamble and sections in place of their ``\input``.

    Raises
    ------
    PaperError
        A part that has no file.
    """

    def part(match: re.Match[str]) -> str:
        path = document.parent / match[1]
        if not path.is_file():
            raise PaperError(f"{document}: no file {path}")
        return path.read_text(encoding="utf-8")

    return _PART.sub(part, document.read_text(encoding="utf-8"))


def documents(folder: Path) -> dict[str, str]:
    """Whole source of each document of the manuscript in ``folder``, by its name.

    Raises
    ------
    PaperError
        A part that has no file.
    """
    return {name: whole_source(folder / f"{name}.tex") for name in DOCUMENTS}


def source_files(root: Path) -> list[str]:
    """Files of the source below ``root``, the documents first."""
    folder = root / "paper"
    files = [folder / f"{name}.tex" for name in (*DOCUMENTS, "preamble")]
    for below in ("sections", "supplement"):
        files += sorted((folder / below).glob("*.tex"))
    return [path.relative_to(root).as_posix() for path in files]
