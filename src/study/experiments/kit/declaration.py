"""Declaration of an experiment: a question that the study asks, with files as the answer."""

from collections.abc import Callable, Mapping
from typing import Any

from study.artifact.artifact import Artifact, declare, declared_in
from study.artifact.paths import Place
from study.artifact.reads import Read


class Experiment(Artifact):
    """An artifact whose function writes its files itself."""


def experiment(
    title: str,
    *,
    reads: Mapping[str, Read],
    writes: Mapping[str, Place],
    alone: bool = False,
) -> Callable[[Callable[..., None]], Experiment]:
    """Declare the function below as an experiment, see `Artifact`.

    ``title`` names its jobs; nothing runs at the same time as those of an ``alone`` one.

    Raises
    ------
    TypeError
        If the function does not take what it reads and writes.
    """

    def decorate(function: Callable[..., Any]) -> Experiment:
        made = Experiment(function.__name__, title, reads, writes, function, alone)
        return declare(made, *writes)

    return decorate


def experiments() -> dict[str, Experiment]:
    """Return every experiment of the study by name."""
    return declared_in("study.experiments", Experiment)
