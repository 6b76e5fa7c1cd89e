"""Every test with the values that it found, and verdicts under other rules, by hand."""

import pandas as pd

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
SHARES = frame("scene local_share", ("a", 0.75), ("b", 0.5)).assign(implementation="compiled")


def made(**rule) -> pd.DataFrame:
    """Variations of a claim with this test, published and beyond."""
    test = {"what": "w", "metric": "reconstruction_error", "compare": ">=", "threshold": 0.5}
    tests = (validate(TestRule, test | rule, "test"),)
    rules = {"C1": ClaimRule.model_construct(published=tests, beyond=tests)}
    tables = {"reconstruction_error": ERRORS, "local_share": SHARES}
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
    rows = made(metric="local_share", threshold=0.35)
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


def test_every_test_says_what_it_found_and_those_that_decide_give_the_verdicts():
    tables = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    assert module.sensitivity_rows(load_claims(PATH), tables).empty
    shares = frame("scene local_share", ("a", 0.2), ("b", 0.8), ("c", 0.9))
    tables["local_share"] = shares.assign(implementation="compiled")
    outcomes = module.claims_tests(PATH, {}, **tables)
    one = outcomes[(outcomes.claim == "C1") & (outcomes.part == "beyond")].iloc[0]
    assert (one.satisfied, one.of, one.close, one.verdict) == (2, 3, 2, module.MACHINE)
    assert (one.margin, one.least, one["median"], one.most) == (4.0, 0.2, 0.8, 0.9)
    nothing = outcomes[outcomes.of == 0]
    assert (nothing.verdict == module.UNDECIDED).all()
    assert nothing[["least", "median", "most"]].isna().all(axis=None)
    # words tell the tests of a part apart
    assert not outcomes.duplicated(["claim", "part", "what"]).any()
    for row in module.claims(PATH, {}, **tables).itertuples():
        for part, verdict in (("published", row.verdict), ("beyond", row.verdict_beyond)):
            mine = outcomes[(outcomes.claim == row.claim) & (outcomes.part == part)]
            assert module.combined(list(mine.verdict[mine.decides])) == verdict
