"""Numbers of the figures: in the manuscript, by the order of its source, and in the preprint."""

import re
from dataclasses import dataclass
from pathlib import Path

from pdrom.report.figures.kit.catalogue import declarations
from pdrom.report.paper.source import whole_source

_COMMENT = re.compile(r"(?<!\\)%.*")
_PLACED = re.compile(r"\\figureof\{(\w+)\}")


@dataclass(frozen=True)
class Numbers:
    """Numbers of a figure in ``main.pdf`` and in the preprint; None where it does not stand."""

    manuscript: int | None
    preprint: int | None

    @property
    def words(self) -> str:
        """Both numbers, as in "figure 10 of main.pdf, figure 8 of the preprint"."""
        places = {"main.pdf": self.manuscript, "the preprint": self.preprint}
        return ", ".join(f"figure {n} of {place}" for place, n in places.items() if n is not None)

    def label(self, name: str) -> str:
        """Name of the figure with its numbers behind it, if it has one."""
        return f"{name} ({self.words})" if self.words else name


def figure_numbers(root: Path) -> dict[str, Numbers]:
    """Both numbers of every figure by name, from the manuscript's source below ``root``.

    Raises
    ------
    PaperError
        A section of the manuscript has no file.
    """
    source = _COMMENT.sub("", whole_source(root / "paper" / "main.tex"))
    placed = _PLACED.findall(source)
    counted = {name: number for number, name in enumerate(placed, 1)}
    return {name: Numbers(counted.get(name), f.number) for name, f in declarations().items()}
