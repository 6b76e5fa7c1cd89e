"""Every test with the values that it found, and verdicts under other rules, by hand."""

import pandas as pd
import pytest

from builders import frame
from pdrom.core.yamlfile import validate
from places import ROOT
from study.tables import declared
from study.tables.claims import claims as module
from study.tables.claims.rules import PARTS, ClaimRule, TestRule, load_claims

PATH = ROOT / "config" / "claims.yaml"
ERRORS = frame(
    "scene r relative_error", ("a", 6, 0.9), ("a", 20, 0.3), ("b", 6, 0.8), ("b", 20, 0.4)
).assign(group="spring", method="deim", split="train", gain=1.0)


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
    rows = module.sensitivity_rows(rules, tables)
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
    assert verdicts(rows, "margin") == {
        "1": "holds", "1.25": "holds", "1.5": "holds",
        **dict.fromkeys(("2", "3", "5"), module.MACHINE),
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
    assert module.sensitivity_rows(load_claims(PATH), empty).empty


# Every test ---------------------------------------------------------------------------------------

SHARES = pd.DataFrame(
    {"scene": ["a", "b", "c"], "implementation": "compiled", "local_share": [0.2, 0.8, 0.9]}
)


@pytest.fixture(scope="module")
def tables() -> dict[str, pd.DataFrame]:
    empty = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    return empty | {"local_share": SHARES}


@pytest.fixture(scope="module")
def outcomes(tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    return module.claims_tests(PATH, {}, **tables)


def test_what_a_test_found(outcomes):
    found = outcomes[(outcomes.claim == "C1") & (outcomes.part == "beyond")]
    one = found.iloc[0]
    assert (one.satisfied, one.of, one.close, one.verdict) == (2, 3, 2, module.MACHINE)
    assert one.margin == 4.0
    assert (one.least, one["median"], one.most) == (0.2, 0.8, 0.9)


def test_a_test_without_rows_is_undecided(outcomes):
    nothing = outcomes[outcomes.of == 0]
    assert (nothing.verdict == module.UNDECIDED).all()
    assert nothing[["least", "median", "most"]].isna().all(axis=None)


def test_the_tests_that_decide_give_the_verdicts(tables, outcomes):
    for row in module.claims(PATH, {}, **tables).itertuples():
        for part, verdict in (("published", row.verdict), ("beyond", row.verdict_beyond)):
            mine = outcomes[(outcomes.claim == row.claim) & (outcomes.part == part)]
            mine = mine[mine.decides]
            assert module.combined(list(mine.verdict)) == verdict


def test_words_tell_the_tests_of_a_part_apart(outcomes):
    assert not outcomes.duplicated(["claim", "part", "what"]).any()
