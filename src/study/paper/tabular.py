"""Rows of text as tables of TeX."""

from collections.abc import Sequence

from pdrom.view.text import escape


def tabular(header: Sequence[str], rows: Sequence[Sequence[str]], columns: str) -> str:
    """A tabular of ``rows`` with a ruled ``header``; cells are TeX already, as is ``columns``."""
    lines = [rf"\begin{{tabular}}{{{columns}}}", *_head(header), *map(_line, rows)]
    return "\n".join([*lines, r"\hline", r"\end{tabular}"]) + "\n"


def longtable(header: Sequence[str], rows: Sequence[Sequence[str]], columns: str) -> str:
    r"""Table that may break across pages, below ``\captionrow``, which the text defines."""
    head = _head(header)
    lines = [rf"\begin{{longtable}}{{{columns}}}", r"\captionrow", *head, r"\endfirsthead"]
    lines += [*head, r"\endhead", *map(_line, rows)]
    return "\n".join([*lines, r"\hline", r"\end{longtable}"]) + "\n"


def _head(header: Sequence[str]) -> list[str]:
    return [r"\hline", _line(header), r"\hline"]


def _line(cells: Sequence[str]) -> str:
    return " & ".join(cells) + r" \\"


def name(text: str) -> str:
    """Name ``text`` of a scene, group or method, in typewriter."""
    return rf"\texttt{{{escape(text)}}}"
