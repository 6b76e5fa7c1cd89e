"""The ablation of block DEIM in a position subspace: which variants run where."""

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.reduction.subspace.specs import InterpolationSpec

Sizes = Annotated[tuple[Annotated[int, Field(ge=1, le=1000)], ...], Field(min_length=1)]


class AblationSpec(ConfigModel):
    """Content of config/subspace_ablation.yaml.

    scenes : where it runs, as far as a configuration holds them
    sizes : modes k of the position basis
    modes : modes r of the projections; they replace those of the variants
    variants : name -> interpolation
    """

    scenes: tuple[str, ...]
    sizes: Sizes
    modes: Sizes
    variants: Annotated[dict[str, InterpolationSpec], Field(min_length=1)]

    @model_validator(mode="after")
    def _modes_once(self) -> Self:
        for name, variant in self.variants.items():
            if "modes" in variant.model_fields_set:
                raise ValueError(f"variants.{name}.modes: given by 'modes' for all variants")
        return self

    def cases(self) -> list[tuple[str, InterpolationSpec]]:
        """(variant, interpolation) for every number of modes, in order."""
        return [
            (name, variant.model_copy(update={"modes": r}))
            for r in self.modes
            for name, variant in self.variants.items()
        ]


def load_ablation(path: Path) -> AblationSpec:
    """Ablation of a configuration file; ConfigurationError for any fault."""
    return validate(AblationSpec, read_yaml(path), str(path))
