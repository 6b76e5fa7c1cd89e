"""config/verification.yaml: variants, margins and least tolerances."""

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.tables.quantities import Quantity
from pdrom.verification.spread import COMPARED

PATH = Path("config/verification.yaml")
RULES = Path("config/claims.yaml")
Positive = Annotated[float, Field(gt=0.0)]


class Settings(ConfigModel):
    """How tolerances are derived.

    variants : environment variables of each variant, by its name
    margins, least : of each quantity that is compared within a tolerance
    anew : share of the rows of a table whose samples may have been chosen anew
    """

    variants: dict[str, dict[str, str]]
    margins: dict[Quantity, Positive]
    least: dict[Quantity, Annotated[float, Field(ge=0.0)]]
    anew: Annotated[float, Field(ge=0.0, le=1.0)]

    @model_validator(mode="after")
    def _every_quantity(self) -> Self:
        for key in ("margins", "least"):
            lacking = sorted(set(COMPARED) ^ set(getattr(self, key)))
            if lacking:
                raise ValueError(f"{key}: one for each of {', '.join(COMPARED)}; see {lacking}")
        return self


def load_settings(root: Path = Path()) -> Settings:
    """Settings of the project; ConfigurationError if they are faulty."""
    return validate(Settings, read_yaml(root / PATH), str(PATH))
