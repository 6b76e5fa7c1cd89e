"""Choices of the published code in which this study's method `published` differs from it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

from pdrom.core.yamlfile import ConfigModel

Choice = Literal[
    "pins", "heavy", "stiffness", "floor", "mesh", "turns", "plane",
    "frames", "weighting", "idle", "signs", "system", "rows",
]  # fmt: skip

# In the order in which the data pass them: simulation, snapshots, basis, rows, test.
ALL: tuple[Choice, ...] = get_args(Choice)

TITLES: dict[Choice, str] = {
    "pins": "nothing is pinned",
    "heavy": "pins are masses of 1e10 kg",
    "stiffness": "springs of half the weight",
    "floor": "floor before the iterations",
    "mesh": "its mesh and numbering",
    "turns": "inverted elements turned otherwise",
    "plane": "triangles projected in the rest plane",
    "frames": "every second frame from the first",
    "weighting": "snapshots weighted by areas or volumes",
    "idle": "axes at rest select as well",
    "signs": "signs of the modes as LAPACK returns them",
    "system": "normal equations without Tikhonov term",
    "rows": "tested on rows numbered like elements",
}
STUDY = "as in this study"

# What a row of the table is: the choices added one after the other, each of them alone, or all of
# them with something drawn that the published code leaves to rounding: the signs of the modes, or
# which of several rows with equal residuals is picked.
CUMULATIVE, ALONE, SIGNS, TIES = "cumulative", "alone", "signs", "ties"


class Case(ConfigModel):
    """A group of a scene whose output by the published code is stored as that of ``experiment``."""

    scene: str
    group: str
    experiment: str


@dataclass(frozen=True)
class Variant:
    """A row of the table: which choices are the published code's, and seeds of what is drawn."""

    direction: str
    title: str
    taken: frozenset[Choice]
    signs: int | None = None
    ties: int | None = None


def variants(applicable: tuple[Choice, ...], draws: int) -> Iterator[Variant]:
    """All variants of a case, from this study's method to the published code's.

    ``applicable`` choices are taken one after the other, then alone; ``draws`` is the number of
    seeds for signs, and for ties.
    """
    taken: frozenset[Choice] = frozenset()
    yield Variant(CUMULATIVE, STUDY, taken)
    for choice in applicable:
        taken |= {choice}
        yield Variant(CUMULATIVE, TITLES[choice], taken)
    for choice in applicable:
        yield Variant(ALONE, TITLES[choice], frozenset({choice}))
    for seed in range(1, draws + 1):
        yield Variant(SIGNS, f"draw {seed}", taken, signs=seed)
    for seed in range(1, draws + 1):
        yield Variant(TIES, f"draw {seed}", taken, ties=seed)
