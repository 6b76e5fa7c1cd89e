"""Verdicts under other rules: each variation by hand."""

import pandas as pd

from pdrom.core.yamlfile import validate
from places import ROOT
from study.tables import declared
from study.tables.claims.claims import sensitivity_rows
from study.tables.claims.rules import PARTS, ClaimRule, TestRule, load_claims

ERRORS = pd.DataFrame(
    {
        "scene": ["a", "a", "b", "b"],
        "group": "spring",
        "method": "deim",
        "r": [6, 20, 6, 20],
        "split": "train",
        "relative_error": [0.9, 0.3, 0.8, 0.4],
        "gain": 1.0,
    }
)


def made(**rule) -> pd.DataFrame:
    """Variations of a claim whose published part is this test."""
    test = {
        "what": "w", "metric": "reconstruction_error", "compare": ">=", "threshold": 0.5, **rule,
    }  # fmt: skip
    return rows_of(test, {"reconstruction_error": ERRORS})


def rows_of(test: dict, tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Variations of a claim with this test, published and beyond, and these tables."""
    tests = (validate(TestRule, test, "test"),)
    rules = {"C1": ClaimRule.model_construct(published=tests, beyond=tests)}
    rows = sensitivity_rows(rules, tables)
    assert set(rows.part) == set(PARTS)
    return rows[rows.part == "published"]


def verdicts(rows: pd.DataFrame, varied: str) -> dict[str, str]:
    chosen = rows[rows.varied == varied]
    return dict(zip(chosen.variation, chosen.verdict, strict=True))


def test_thresholds_and_shares():
    rows = made()
    assert set(rows.verdict_of_rules) == {"depends"}
    assert verdicts(rows, "threshold") == {
        "x 0.5": "holds", "x 0.8": "holds", "x 1.25": "depends", "x 2": "does not hold",
    }  # fmt: skip
    assert verdicts(rows, "share") == {
        "0.5": "holds", "0.6": "depends", "0.75": "depends", "0.9": "depends", "1": "depends",
    }  # fmt: skip
    assert (rows.same == (rows.verdict == "depends")).all()


def test_margins_vary_where_times_are_compared():
    assert verdicts(made(), "margin") == {}
    shares = pd.DataFrame(
        {"scene": ["a", "b"], "implementation": "compiled", "local_share": [0.75, 0.5]}
    )
    test = {"what": "w", "metric": "local_share", "compare": ">=", "threshold": 0.35}
    rows = rows_of(test, {"local_share": shares})
    machine = "depends on the machine"
    assert verdicts(rows, "margin") == {
        "1": "holds", "1.25": "holds", "1.5": "holds", "2": machine, "3": machine, "5": machine,
    }  # fmt: skip
    assert set(rows.verdict_of_rules) == {"holds"}


def test_rows_that_are_left_out():
    rows = made()
    assert verdicts(rows, "sizes") == {"r up to 10": "holds", "r above 10": "does not hold"}
    assert verdicts(rows, "scenes") == {"without a": "depends", "without b": "depends"}
    assert verdicts(made(where={"scene": ["a"]}), "scenes") == {}


def test_splits_vary_where_a_test_names_one():
    assert verdicts(made(), "splits") == {}
    # no row of this table is of another split: there is nothing to vary to
    assert verdicts(made(where={"split": ["train"]}), "splits") == {}
    assert verdicts(made(where={"split": ["test", "train"]}), "splits") == {"train": "depends"}


def test_a_claim_without_data_has_no_variations():
    empty = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    assert sensitivity_rows(load_claims(ROOT / "config" / "claims.yaml"), empty).empty
