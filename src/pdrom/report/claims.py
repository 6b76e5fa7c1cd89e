"""Verdicts on the paper's claims, by rules of config/claims.yaml that code evaluates.

A claim is decided by tests: a metric over chosen rows of the tables, compared with a threshold. The
first tests marked ``decides`` give the verdict, the others stand beside it in the reason.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import pandas as pd
from pydantic import Field, FiniteFloat, model_validator

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from pdrom.tables import declared
from pdrom.tables.break_even import CURVE

VERDICTS = HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "cannot be decided"
Tables = Mapping[str, pd.DataFrame]
Value = str | int | float
_PLACE = ("scene", "group", "method", "position_basis")


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


@dataclass(frozen=True)
class Outcome:
    """Result of one test: None where there was nothing to compare."""

    passed: bool | None
    measured: str
    sentence: str


def _filter(table: pd.DataFrame, where: Mapping[str, tuple[Value, ...]]) -> pd.DataFrame:
    for column, allowed in where.items():
        if column not in table.columns:
            raise ConfigurationError(
                f"claims: no column '{column}' (allowed: {', '.join(table.columns)})"
            )
        table = table[table[column].isin(allowed)]
    return table


def _full_rank_only(table: pd.DataFrame, where: dict) -> tuple[pd.DataFrame, dict]:
    """Handles ``r: [full]``: the largest size tried for each scene, group and method.

    A run that blew up before its first frame was tried, too: leaving it out would put a smaller
    size, which survived, in the place of full rank.
    """
    if "r" not in where or "full" not in where["r"]:
        return table, where
    ran = _tried(table)
    largest = ran.groupby(["scene", "group", "method"]).r.transform("max")
    return ran[ran.r == largest], {k: v for k, v in where.items() if k != "r"}


def _reruns(tables: Tables, where: dict) -> pd.DataFrame:
    """Reruns; only those whose positions are not reduced, unless ``where`` says otherwise.

    A method may have the same name with full and with reduced positions.
    """
    table = tables["reduced_reruns"]
    return table if "position_basis" in where else table[table.position_basis == "full"]


def _tried(rows: pd.DataFrame) -> pd.DataFrame:
    """Reruns that started: not the marked ones, whose size exceeds the numerical rank."""
    return rows[(rows.frames > 0) | rows.blowup_frame.notna()]


def _local_share(tables: Tables, where: dict) -> pd.Series:
    return _filter(tables["local_share"], where).local_share


def _rerun_error(tables: Tables, where: dict) -> pd.Series:
    """Error within the horizon; a run that blew up before its horizon counts as infinite."""
    table, where = _full_rank_only(_reruns(tables, where), where)
    return _tried(_filter(table, where)).relative_error_within_horizon.fillna(np.inf)


def _error_trend(tables: Tables, where: dict) -> pd.Series:
    """Spearman's rank correlation of error and size, per scene, group and method.

    1 where the error rises with every size, -1 where it falls; blow-ups share the highest rank.
    Fewer than three sizes have no trend; errors that are all equal have the trend 0.
    """
    rows = _tried(_filter(_reruns(tables, where), where))
    trends = []
    for _, run in rows.groupby(["scene", "group", "method"], sort=False):
        error = run.relative_error_within_horizon.fillna(np.inf)
        if len(run) >= 3:
            trend = 0.0 if error.nunique() == 1 else error.rank().corr(run.r.rank())
            trends.append(trend)
    return pd.Series(trends, dtype=float)


def _decay(tables: Tables, where: dict) -> pd.Series:
    rows = _filter(tables["singular_values"], where)
    real = rows.groupby(["scene", "group"]).above_roundoff.transform("any")
    return rows[real].relative


def _reconstruction(tables: Tables, where: dict) -> pd.Series:
    """Reconstruction error; a singular interpolation counts as infinite."""
    rows = _filter(tables["reconstruction_error"], where)
    return rows[rows.gain.notna()].relative_error.fillna(np.inf)


def _elements_per_entry(tables: Tables, where: dict) -> pd.Series:
    rows = _filter(tables["reconstruction_error"], where)
    rows = rows[rows.elements_sampled.notna()]
    return rows.elements_sampled.astype(float) / rows.r


def _local_ratio(tables: Tables, where: dict) -> pd.Series:
    """Time of the reduced local step over that of the full compiled one, at the largest size.

    One value per scene, group, method, mesh and number of threads: whether the dense solve costs
    more from some size on shows at the largest size that the basis has.
    """
    rows = _filter(tables["breakeven"], where).dropna(subset=["ratio"]).sort_values("r")
    largest = rows.groupby(CURVE, sort=False).tail(1)
    return largest.sort_index().ratio


def _position_basis_ratio(tables: Tables, where: dict) -> pd.Series:
    """Error of the snapshot basis over that of the skinning basis at equal k, per scene."""
    rows = _filter(tables["reduced_reruns"], where)
    keys = ["scene", "k"]
    errors = {
        kind: rows[rows.position_basis == kind].set_index(keys).relative_error_within_horizon
        for kind in ("pod", "skinning")
    }
    return (errors["pod"] / errors["skinning"]).dropna()


@dataclass(frozen=True)
class Metric:
    """What a test compares: values from some columns of one table."""

    values: Callable[[Tables, dict], pd.Series]
    table: str
    columns: tuple[str, ...]


_RERUN = ("frames", "blowup_frame", "relative_error_within_horizon")
METRICS = {
    "local_share": Metric(_local_share, "local_share", ("local_share",)),
    "rerun_error": Metric(_rerun_error, "reduced_reruns", (*_RERUN, *_PLACE, "r")),
    "error_trend": Metric(_error_trend, "reduced_reruns", (*_RERUN, *_PLACE, "r")),
    "singular_value_decay": Metric(
        _decay, "singular_values", ("scene", "group", "above_roundoff", "relative")
    ),
    "reconstruction_error": Metric(
        _reconstruction, "reconstruction_error", ("gain", "relative_error")
    ),
    "elements_per_entry": Metric(
        _elements_per_entry, "reconstruction_error", ("elements_sampled", "r")
    ),
    "local_time_ratio": Metric(_local_ratio, "breakeven", (*CURVE, "r", "ratio")),
    "position_basis_ratio": Metric(
        _position_basis_ratio,
        "reduced_reruns",
        ("scene", "k", "position_basis", "relative_error_within_horizon"),
    ),
}


def timed_columns(rule: ClaimRule) -> set[str]:
    """Columns of a claim's row in which a clock has a say: two runs may differ there."""
    timed = [test for test in rule.tests if _is_timed(test)]
    if not timed:
        return set()
    return {"why", "measured", "verdict"} if any(t.decides for t in timed) else {"why"}


def _is_timed(test: TestRule) -> bool:
    metric = METRICS[test.metric]
    timing = declared()[metric.table].timing_columns
    return not set(timing).isdisjoint({*metric.columns, *test.where})


def evaluate(test: TestRule, tables: Tables) -> Outcome:
    """Compare the rows of a test with its threshold."""
    values = METRICS[test.metric].values(tables, dict(test.where)).to_numpy(float)
    if len(values) == 0:
        return Outcome(None, "no data", f"{test.what}: {_why_empty(test, tables)}")
    passed = values >= test.threshold if test.compare == ">=" else values <= test.threshold
    good, total = int(passed.sum()), len(values)
    spread = _range(values)
    sign = "at least" if test.compare == ">=" else "at most"
    sentence = f"{test.what}: {good} of {total} {sign} {test.threshold:g} (measured {spread})"
    return Outcome(good >= test.share * total, spread, sentence)


def _why_empty(test: TestRule, tables: Tables) -> str:
    """Why a test has no values: reruns that could not start, or none in this configuration."""
    if test.metric == "rerun_error":
        where = {k: v for k, v in test.where.items() if k != "r"}
        if len(_filter(tables["reduced_reruns"], where)):
            return "no size can run, the numerical rank allows none"
    return "nothing to compare in this configuration"


def _range(values: np.ndarray) -> str:
    low, high = _text(values.min()), _text(values.max())
    return low if low == high else f"{low} to {high}"


def _text(value: float) -> str:
    if np.isinf(value):
        return "blow-up"
    if 100.0 <= abs(value) < 1e5:
        return f"{float(f'{value:.2g}'):.0f}"
    return f"{value:.2g}"


def claims_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """Rows of the table claims, in the order of the file."""
    return pd.DataFrame([_row(name, rule, tables) for name, rule in rules.items()])


def _row(name: str, rule: ClaimRule, tables: Tables) -> dict[str, Any]:
    outcomes = [(test, evaluate(test, tables)) for test in rule.tests]
    deciding = [o for test, o in outcomes if test.decides]
    if any(o.passed is None for o in deciding):
        verdict = UNDECIDED
    else:
        verdict = HOLDS if all(o.passed for o in deciding) else FAILS
    return {
        "claim": name,
        "source": rule.source,
        "paper": rule.paper,
        "measured": "; ".join(o.measured for o in deciding),
        "verdict": verdict,
        "why": "; ".join(o.sentence for _, o in outcomes) + ".",
        "figure_or_table": rule.figure_or_table,
    }
