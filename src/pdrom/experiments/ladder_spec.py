"""The ladder: from the published choices to sound ones, one ingredient at a time."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.reduction.method import MethodSpec

Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class LadderSpec(ConfigModel):
    """Content of config/ladder.yaml.

    r : basis size of all rungs (the numerical rank where that is smaller)
    signs : how many choices of the singular vectors' signs the first rung is repeated with
    scenes : where it is climbed, as far as a configuration holds them
    up, down : methods, from the published one upwards, and the sound one less one ingredient
    """

    r: Annotated[int, Field(ge=1, le=100_000)]
    signs: Annotated[int, Field(ge=0, le=100)]
    scenes: tuple[str, ...]
    up: Rungs
    down: Rungs

    def rungs(self) -> list[tuple[str, MethodSpec, int | None]]:
        """(direction, method, seed of the signs) of all rows, in order."""
        rows = [("up", method, None) for method in self.up]
        rows += [("down", method, None) for method in self.down]
        return rows + [("signs", self.up[0], seed) for seed in range(1, self.signs + 1)]


def load_ladder(path: Path) -> LadderSpec:
    """Ladder of a configuration file; ConfigurationError for any fault."""
    return validate(LadderSpec, read_yaml(path), str(path))
