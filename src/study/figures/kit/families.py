"""Families of reduced models: what belongs together has one colour, and markers within it."""

from collections.abc import Sequence
from dataclasses import dataclass

from pdrom.view import style
from study.figures.kit.results import Results
from study.tables.accuracy_cost import FEWER

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")


@dataclass(frozen=True)
class Family:
    """Models of one kind, told apart from the others by their colour."""

    title: str
    colour: str


ITERATIONS = Family("full order, fewer iterations", style.BLACK)
PROJECTION = Family("orthogonal projection", style.PURPLE)
ENTRIES = Family("single entries, joint rows", style.VERMILLION)
ELEMENTS = Family("whole elements", style.BLUE)
WEIGHTED = Family("subspace, weighted or full", style.GREEN)
INTERPOLATED = Family("subspace, interpolated", style.ORANGE)
FAMILIES = (ITERATIONS, PROJECTION, ENTRIES, ELEMENTS, WEIGHTED, INTERPOLATED)
_BY_ROWS = {"all": PROJECTION, "scalar": ENTRIES, "joint": ENTRIES, "element": ELEMENTS}


@dataclass(frozen=True)
class Model:
    """A method with the kind of position basis that it is used in (``full`` for none)."""

    method: str
    position_basis: str

    @property
    def hollow(self) -> bool:
        """Whether its markers are hollow: its position basis is that of skinning."""
        return self.position_basis == "skinning"

    def title(self, results: Results) -> str:
        """Name within its family, which models share that differ by tolerance or basis only.

        Titles of methods are those of ``results``.
        """
        if self.position_basis == "full":
            return results.method_title(self.method)
        if self.method == "full":
            return "all projections"
        return "ecsw, by tolerance" if self.method.startswith("ecsw") else self.method

    def family(self, results: Results) -> Family | None:
        """Family of the model by ``results``; None for a method that is not drawn."""
        if self.method == FEWER:
            return ITERATIONS
        if self.position_basis != "full":
            weighted = self.method == "full" or self.method.startswith("ecsw")
            return WEIGHTED if weighted else INTERPOLATED
        held = results.holdings.methods.get(self.method)
        return _BY_ROWS[held.rows] if held else None


def markers(models: Sequence[Model], results: Results) -> dict[Model, str]:
    """A marker for each title of ``models`` within a family, in their order, by ``results``."""
    found: dict[Model, str] = {}
    for family in FAMILIES[1:]:
        members = [model for model in models if model.family(results) == family]
        titles = list(dict.fromkeys(model.title(results) for model in members))
        for model in members:
            found[model] = MARKERS[titles.index(model.title(results)) % len(MARKERS)]
    return found
