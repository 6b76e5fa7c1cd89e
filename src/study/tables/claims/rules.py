"""Rules of config/claims.yaml: claims of the preprint, each with tests for two verdicts."""

import datetime
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self

from pydantic import Field, FiniteFloat, model_validator

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from study.artifact.reads import ProjectFile, Read, Setting, TableOf
from study.tables import declared
from study.tables.claims.metrics import METRICS, Value

SETS = "sets"
_NAMED = "@"  # "@name" in ``where`` stands for all values of the set ``name``
Added = Mapping[str, Sequence[Value]]
MARGIN = 1.5  # default of `TestRule.margin` for tests that compare times
PARTS = {"published": "", "beyond": "_beyond"}  # field of `ClaimRule` -> suffix in table claims
# Inputs of tables about claims: rules, scenes to add to sets in them, tables that metrics read.
READS: dict[str, Read] = {
    "rules": ProjectFile("config/claims.yaml"),
    "added": Setting("claim_sets"),
    **{name: TableOf(name) for name in sorted({metric.table for metric in METRICS.values()})},
}


class TestRule(ConfigModel):
    """Test of a claim: comparison of a metric with a threshold.

    what : description of the compared quantity and rows, which must be understood without context
    metric, where : name in `METRICS`; column -> allowed values
    accuracy : a run counts as accurate up to this error, in metrics that need accurate runs
    margin : a ratio of times that differs from the threshold by less than this factor counts
        neither for nor against the claim; None for the default, see `factor`
    share : see `study.tables.claims.claims.answer`
    by : column by whose values rows are counted, to explain a verdict "depends"
    decides : whether the verdict on the claim uses this test
    """

    __test__ = False

    what: str
    metric: str
    where: dict[str, tuple[Value, ...]] = Field(default_factory=dict)
    compare: Literal[">=", "<="]
    threshold: FiniteFloat
    accuracy: Annotated[float, Field(gt=0.0)] = 0.1
    margin: Annotated[FiniteFloat, Field(ge=1.0)] | None = None
    share: Annotated[float, Field(ge=0.5, le=1.0)] = 0.75
    by: str | None = None
    decides: bool = True

    @property
    def timed(self) -> bool:
        """Whether the compared values or the selection of rows depend on measured times."""
        metric = METRICS[self.metric]
        timing = declared()[metric.table].timing_columns
        return metric.timed or not set(timing).isdisjoint(self.where)

    @property
    def factor(self) -> float:
        """Margin of the test, by default `MARGIN`; 1 (no margin) if no times are compared."""
        return (self.margin or MARGIN) if self.timed else 1.0

    @model_validator(mode="after")
    def _metric_exists(self) -> Self:
        if self.metric not in METRICS:
            raise ValueError(f"metric = '{self.metric}': allowed are {', '.join(METRICS)}")
        metric = METRICS[self.metric]
        columns = (*declared()[metric.table].column_names, *metric.labels)
        used = [*(("where", column) for column in self.where), *([("by", self.by)] * bool(self.by))]
        for key, column in used:
            if column not in columns:
                raise ValueError(f"{key}: no column '{column}'{choices(column, columns)}")
        if self.margin is not None and not self.timed:
            raise ValueError(f"margin = {self.margin:g}: {self.metric} compares no times")
        return self


class Change(ConfigModel):
    """Date and reason of a change in the rules of a claim.

    after_data : whether the results to which the rules apply were already known at this date
    rules : fingerprint of the rules after the change, see `ClaimRule.fingerprint`
    """

    date: datetime.date
    reason: Annotated[str, Field(min_length=10)]
    after_data: bool
    rules: str | None = None


class ClaimRule(ConfigModel):
    """Claim of the preprint, its section and figures there, and the tests that decide about it.

    text, paper : the claim in our words, and the statement of the preprint in a few words
    section, shown : section and figures of the preprint
    qualifiers : conditions that a fair test has to respect
    published : tests on the preprint's variants of the method and on its scenes
    beyond : tests on the improved method (set ``sound`` of config/claims.yaml) and well-posed
        scenes; if none of them decides, the verdict beyond the preprint is "not tested"
    changes : history of the rules, oldest first
    """

    text: str
    source: str
    paper: str
    section: str
    shown: str
    qualifiers: str
    figure_or_table: str
    published: tuple[TestRule, ...]
    beyond: tuple[TestRule, ...]
    changes: Annotated[tuple[Change, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _sound(self) -> Self:
        if not any(test.decides for test in self.published):
            raise ValueError("published: no test decides; set decides: true for at least one test")
        dates = [change.date for change in self.changes]
        if dates != sorted(dates):
            raise ValueError("changes: dates must ascend; move the entry to its place")
        return self

    @property
    def fingerprint(self) -> str:
        """Hash of eight hexadecimal digits over the rules without their descriptive texts."""
        plain = [
            test.model_dump(mode="json", exclude={"what", "margin"})
            | ({"margin": test.factor} if test.timed else {})
            for test in (*self.published, *self.beyond)
        ]
        content = json.dumps([len(self.published), plain], sort_keys=True)
        return hashlib.blake2b(content.encode(), digest_size=4).hexdigest()


def load_claims(path: Path, added: Added = MappingProxyType({})) -> dict[str, ClaimRule]:
    """Read identifier -> claim from file ``path``; replace ``@name`` by the values of set ``name``.

    ``added`` maps names of sets in the file to values to append, such as scenes of this study only.
    Raises ConfigurationError if the file is invalid, or lacks such a set.
    """
    content = read_yaml(path)
    if not isinstance(content, dict) or not {*content} - {SETS}:
        raise ConfigurationError(f"{path}: a mapping of claims is required")
    sets = content.pop(SETS, {})
    if not isinstance(sets, dict) or not all(isinstance(v, list) for v in sets.values()):
        raise ConfigurationError(f"{path}: {SETS}: a mapping of lists is required")
    for name, values in added.items():
        if name not in sets:
            raise ConfigurationError(f"claim_sets: no set '{name}'{choices(name, sets)}")
        sets[name] = [*sets[name], *values]
    places = {claim: f"{path}: {claim}" for claim in content}
    return {
        str(claim): validate(ClaimRule, _resolved(rule, sets, places[claim]), places[claim])
        for claim, rule in content.items()
    }


def _resolved(entry: Any, sets: Mapping[str, list[Value]], place: str) -> Any:
    """Replace list items ``@name`` of ``entry`` by the set of this name; errors cite ``place``."""
    if isinstance(entry, dict):
        return {key: _resolved(value, sets, place) for key, value in entry.items()}
    if not isinstance(entry, list):
        return entry
    values: list[Any] = []
    for value in entry:
        if isinstance(value, str) and value.startswith(_NAMED):
            name = value.removeprefix(_NAMED)
            if name not in sets:
                raise ConfigurationError(f"{place}: no set '{name}'{choices(name, sets)}")
            values += sets[name]
        else:
            values.append(_resolved(value, sets, place))
    return values
