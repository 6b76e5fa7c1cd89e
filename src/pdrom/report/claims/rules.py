"""Rules of config/claims.yaml: each claim of the paper with the tests that decide it."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, FiniteFloat, model_validator

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.report.claims.metrics import METRICS, Value
from pdrom.tables import declared


class _Model(ConfigModel):
    """Base of the rules."""


class TestRule(_Model):
    """One comparison.

    what : words for the rows that are compared, used in the reason
    metric : name in `METRICS`
    where : column -> allowed values
    share : smallest fraction of the rows that must satisfy the comparison
    """

    __test__ = False

    what: str
    metric: str
    where: dict[str, tuple[Value, ...]] = Field(default_factory=dict)
    compare: Literal[">=", "<="]
    threshold: FiniteFloat
    share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    decides: bool = True

    @model_validator(mode="after")
    def _metric_exists(self) -> Self:
        if self.metric not in METRICS:
            raise ValueError(f"metric = '{self.metric}': allowed are {', '.join(METRICS)}")
        columns = declared()[METRICS[self.metric].table].column_names
        for column in self.where:
            if column not in columns:
                raise ValueError(f"where: no column '{column}'{choices(column, columns)}")
        return self


class ClaimRule(_Model):
    """A claim of the paper, what the paper says, and the tests that decide it."""

    text: str
    source: str
    paper: str
    figure_or_table: str
    tests: Annotated[tuple[TestRule, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _something_decides(self) -> Self:
        if not any(test.decides for test in self.tests):
            raise ValueError("tests: none of them decides")
        return self


def load_claims(path: Path) -> dict[str, ClaimRule]:
    """Claims by identifier; ConfigurationError for any fault."""
    content = read_yaml(path)
    if not isinstance(content, dict) or not content:
        raise ConfigurationError(f"{path}: a mapping of claims is required")
    return {str(c): validate(ClaimRule, rule, f"{path}: {c}") for c, rule in content.items()}
