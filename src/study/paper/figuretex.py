"""Titles and captions of the figures, as TeX macros."""

from collections.abc import Mapping


def captions(texts: Mapping[str, str]) -> str:
    r"""Definitions behind ``\captionof@NAME``, one for each figure; ``texts`` are TeX already."""
    lines = ["% generated from the declarations of the figures", r"\makeatletter"]
    lines += [
        rf"\expandafter\def\csname caption@{name}\endcsname{{{text}}}"
        for name, text in texts.items()
    ]
    return "\n".join([*lines, r"\makeatother"]) + "\n"
