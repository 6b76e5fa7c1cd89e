"""Numbers of the figures: in the paper or its supplement, by their order, and in the preprint."""

import re
from dataclasses import dataclass
from pathlib import Path

from study.figures.kit.declaration import declarations
from study.paper.source import documents

SUPPLEMENT = "S"  # before a number of the supplement
_COMMENT = re.compile(r"(?<!\\)%.*")
_PLACED = re.compile(r"\\figureof\{(\w+)\}")


@dataclass(frozen=True)
class Numbers:
    """Numbers of a figure, as "3" in the paper or "S7" in its supplement, and in the preprint.

    None where it does not stand.
    """

    manuscript: str | None
    preprint: int | None

    @property
    def words(self) -> str:
        """Both numbers, as in "figure S10 of supplement.pdf, figure 8 of the preprint"."""
        own = self.manuscript or ""
        document = "supplement.pdf" if own.startswith(SUPPLEMENT) else "main.pdf"
        places = {document: self.manuscript, "the preprint": self.preprint}
        return ", ".join(f"figure {n} of {place}" for place, n in places.items() if n is not None)

    def label(self, name: str) -> str:
        """Figure's ``name`` with its numbers behind it, if it has any."""
        return f"{name} ({self.words})" if self.words else name


def figure_numbers(root: Path) -> dict[str, Numbers]:
    """Both numbers of every figure by name, from the manuscript's source below ``root``.

    Raises
    ------
    PaperError
        A section of the manuscript has no file.
    """
    counted: dict[str, str] = {}
    for prefix, source in zip(("", SUPPLEMENT), documents(root / "paper").values(), strict=True):
        placed = _PLACED.findall(_COMMENT.sub("", source))
        counted |= {name: f"{prefix}{number}" for number, name in enumerate(placed, 1)}
    return {name: Numbers(counted.get(name), f.number) for name, f in declarations().items()}
