"""``./reproduce figure NUMBER|NAME ... [OPTIONS]``: figures of the paper by number, as targets."""

from collections.abc import Sequence
from itertools import takewhile

from pdrom.core.errors import ConfigurationError, choices
from pdrom.report.figures.kit.catalogue import declarations

WORD = "figure"


def figure_arguments(arguments: Sequence[str]) -> list[str]:
    """Options and targets for Snakemake, from what follows the word ``figure``.

    A number is that of a figure in the paper; a figure of this study has its name alone. A target
    reads ``figure NAME`` (one word), which `pdrom.pipeline.targets.Names` turns into its file.

    Raises
    ------
    ConfigurationError
        No figure was named, or there is no such one.
    """
    asked = list(takewhile(lambda word: not word.startswith("-"), arguments))
    options = [word for word in arguments[len(asked) :] if word != "--"]
    names = {name: name for name in declarations()}
    numbers = {str(f.number): name for name, f in declarations().items() if f.number is not None}
    known = numbers | names
    if not asked:
        raise ConfigurationError(f"{WORD}: its number or name is missing{choices('', known)}")
    for word in asked:
        if word not in known:
            raise ConfigurationError(f"{WORD} {word}: there is none{choices(word, known)}")
    return [*options, "--", *(f"{WORD} {known[word]}" for word in asked)]
