"""The ladder: from the published choices to sound ones, one ingredient at a time."""

from pathlib import Path
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from pdrom.errors import ConfigurationError
from pdrom.method import MethodSpec
from pdrom.yamlfile import read_yaml, validate

Rungs = Annotated[tuple[MethodSpec, ...], Field(min_length=1)]


class LadderSpec(BaseModel):
    """Content of config/ladder.yaml.

    r : basis size of all rungs (the numerical rank where that is smaller)
    signs : how many choices of the singular vectors' signs the first rung is repeated with
    scenes : where it is climbed, as far as a configuration holds them, and which groups of a scene
        (an empty list: all that it reduces)
    up, down : methods, from the published one upwards, and the sound one less one ingredient
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    r: Annotated[int, Field(ge=1)]
    signs: Annotated[int, Field(ge=0, le=100)]
    scenes: dict[str, tuple[str, ...]]
    up: Rungs
    down: Rungs

    @model_validator(mode="after")
    def _titles_tell_rungs_apart(self) -> Self:
        for direction in ("up", "down"):
            titles = [method.title for method in getattr(self, direction)]
            for title in titles:
                if titles.count(title) > 1:
                    raise ValueError(f"{direction}: the title '{title}' is given twice")
        return self

    def climbs(self, scene: str, group: str) -> bool:
        """Whether the ladder is climbed on this group."""
        groups = self.scenes.get(scene)
        return groups is not None and (not groups or group in groups)

    def rungs(self) -> list[tuple[str, MethodSpec, int | None]]:
        """(direction, method, seed of the signs) of all rows, in order."""
        rows = [("up", method, None) for method in self.up]
        rows += [("down", method, None) for method in self.down]
        return rows + [("signs", self.up[0], seed) for seed in range(1, self.signs + 1)]


def load_ladder(path: Path) -> LadderSpec:
    """Ladder of a configuration file; ConfigurationError for any fault.

    A scene that no file beside it, scenes/{scene}.yaml, describes is a fault, one that a
    configuration does not hold is not.
    """
    ladder = validate(LadderSpec, read_yaml(path), str(path))
    for scene in ladder.scenes:
        if not (path.parent / "scenes" / f"{scene}.yaml").is_file():
            raise ConfigurationError(f"{path}: scenes: unknown scene '{scene}'")
    return ladder
