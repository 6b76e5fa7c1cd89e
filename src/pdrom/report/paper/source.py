r"""The manuscript's source: ``main.tex`` and, in a folder beside it, a file for each section."""

import re
from pathlib import Path

from pdrom.core.errors import PaperError

_SECTION = re.compile(r"\\input\{(sections/[^{}]*\.tex)\}")


def whole_source(main: Path) -> str:
    r"""Text of ``main`` with its sections in place of their ``\input{sections/NAME.tex}``.

    Raises
    ------
    PaperError
        A section that has no file.
    """

    def section(match: re.Match[str]) -> str:
        path = main.parent / match[1]
        if not path.is_file():
            raise PaperError(f"{main}: no file {path}")
        return path.read_text(encoding="utf-8")

    return _SECTION.sub(section, main.read_text(encoding="utf-8"))


def source_files(root: Path) -> list[str]:
    """Files of the source below ``root``, the main one first."""
    sections = sorted((root / "paper" / "sections").glob("*.tex"))
    return ["paper/main.tex", *(path.relative_to(root).as_posix() for path in sections)]
