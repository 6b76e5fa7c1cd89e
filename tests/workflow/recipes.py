"""The recipes of CONTRIBUTING.md, taken from the page: what a reader of it would type.

A block of code below a line "`path`:" is a new file; one below "`path`, below `line`:" is added
to a file that exists, under the line that reads so, indented as that is.
"""

import re
from dataclasses import dataclass

from checkout import Checkout

from places import ROOT

_PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
_BLOCK = re.compile(
    r"^`(?P<path>[^`]+)`(?:, below `(?P<below>[^`]+)`)?:\n\n```\w+\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """Code that belongs into a file, below a line of it or as the whole."""

    path: str
    below: str | None
    code: str

    def add_to(self, checkout: Checkout) -> None:
        """Do what the recipe says."""
        file = checkout.folder / self.path
        if self.below is None:
            assert not file.exists(), f"{self.path} exists"
            file.write_text(self.code, encoding="utf-8")
            return
        lines = file.read_text(encoding="utf-8").splitlines()
        (place,) = [i for i, line in enumerate(lines) if line.strip() == self.below]
        indent = " " * (len(lines[place]) - len(lines[place].lstrip()))
        lines[place + 1 : place + 1] = [indent + line for line in self.code.splitlines()]
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def recipe(title: str) -> list[Block]:
    """Blocks of a section of the page."""
    (section,) = re.findall(rf"^## {title}\n(.*?)(?=^## |\Z)", _PAGE, re.MULTILINE | re.DOTALL)
    return [Block(**found.groupdict()) for found in _BLOCK.finditer(section)]
