"""Bibliography of the cited entries, by pybtex."""

import re
from pathlib import Path

from pybtex.backends.latex import Backend
from pybtex.database import parse_file
from pybtex.errors import set_strict_mode
from pybtex.exceptions import PybtexError
from pybtex.style.formatting.unsrt import Style

from pdrom.core.errors import PaperError

_CITE = re.compile(r"\\cite\{([^}]*)\}")


def cited_keys(source: str) -> list[str]:
    """Keys of a TeX source in order of first citation."""
    keys = [key.strip() for group in _CITE.findall(source) for key in group.split(",")]
    return list(dict.fromkeys(keys))


def bibliography(source: str, references: Path) -> str:
    """The thebibliography environment (TeX) of the entries that ``source`` cites, in that order.

    Raises
    ------
    PaperError
        A cited key is not in ``references`` or lacks a field, or the file is not BibTeX.
    """
    keys = cited_keys(source)
    set_strict_mode(False)
    try:
        database = parse_file(str(references))
    except PybtexError as error:
        raise PaperError(f"{references}: {error}") from error
    missing = [key for key in keys if key not in database.entries]
    if missing:
        raise PaperError(f"{references}: no entry for {', '.join(missing)}")
    try:
        formatted = list(Style().format_entries([database.entries[key] for key in keys]))
    except PybtexError as error:
        raise PaperError(f"{references}: {error}") from error
    backend = Backend(encoding="utf-8")
    lines = [r"\begin{thebibliography}{99}"]
    for entry in formatted:
        lines += [rf"\bibitem{{{entry.key}}}", entry.text.render(backend), ""]
    lines.append(r"\end{thebibliography}")
    return "\n".join(lines) + "\n"
