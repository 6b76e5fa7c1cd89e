"""``./reproduce figure NUMBER|SNUMBER|preprint:NUMBER|NAME ... [OPTIONS]``: figures as targets."""

from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

from pdrom.core.errors import ConfigurationError, choices
from study.paper.figure_numbers import SUPPLEMENT, figure_numbers

WORD = "figure"
PREPRINT = "preprint:"


def figure_arguments(arguments: Sequence[str]) -> list[str]:
    """Options and targets for Snakemake, from the ``arguments`` that follow the word ``figure``.

    A number counts in the paper, one with an S before it in the supplement, ``preprint:NUMBER`` in
    the preprint; every figure has its name, too. A target reads ``figure NAME`` (one word), which
    `study.pipeline.targets.Names` turns into its file.

    Raises
    ------
    ConfigurationError
        No figure was named, or there is no such one.
    """
    asked = list(takewhile(lambda word: not word.startswith("-"), arguments))
    options = [word for word in arguments[len(asked) :] if word != "--"]
    numbers = figure_numbers(Path())
    by_place = {n.manuscript: name for name, n in numbers.items() if n.manuscript}
    known = {number: by_place[number] for number in sorted(by_place, key=_order)}
    known |= {f"{PREPRINT}{n.preprint}": name for name, n in numbers.items() if n.preprint}
    known |= {name: name for name in numbers}
    if not asked:
        raise ConfigurationError(f"{WORD}: its number or name is missing{choices('', known)}")
    for word in asked:
        if word not in known:
            raise ConfigurationError(f"{WORD} {word}: there is none{choices(word, known)}")
    return [*options, "--", *(f"{WORD} {known[word]}" for word in asked)]


def _order(number: str) -> tuple[bool, int]:
    """Key of a number for sorting: the paper's, then the supplement's."""
    return number.startswith(SUPPLEMENT), int(number.removeprefix(SUPPLEMENT))


def described(target: str) -> str:
    """A target with both numbers, if it is a figure that has one; else the target itself."""
    word, _, name = target.partition(" ")
    return f"{WORD} {figure_numbers(Path())[name].label(name)}" if word == WORD else target
