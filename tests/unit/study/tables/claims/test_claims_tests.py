"""Table claims_tests: every test with what it found; the verdicts are those of the table claims."""

import pandas as pd
import pytest

from places import ROOT
from study.tables import declared
from study.tables.claims.claims import claims, claims_tests
from study.tables.claims.verdicts import MACHINE, UNDECIDED, combined

PATH = ROOT / "config" / "claims.yaml"
SHARES = pd.DataFrame(
    {"scene": ["a", "b", "c"], "implementation": "compiled", "local_share": [0.2, 0.8, 0.9]}
)


@pytest.fixture(scope="module")
def tables() -> dict[str, pd.DataFrame]:
    empty = {name: table.checked(pd.DataFrame()) for name, table in declared().items()}
    return empty | {"local_share": SHARES}


@pytest.fixture(scope="module")
def outcomes(tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    return claims_tests(PATH, **tables)


def test_what_a_test_found(outcomes):
    found = outcomes[(outcomes.claim == "C1") & (outcomes.part == "beyond")]
    one = found.iloc[0]
    assert (one.satisfied, one.of, one.close, one.verdict) == (2, 3, 2, MACHINE)
    assert one.margin == 4.0
    assert (one.least, one["median"], one.most) == (0.2, 0.8, 0.9)


def test_a_test_without_rows_is_undecided(outcomes):
    nothing = outcomes[outcomes.of == 0]
    assert (nothing.verdict == UNDECIDED).all()
    assert nothing[["least", "median", "most"]].isna().all(axis=None)


def test_the_tests_that_decide_give_the_verdicts(tables, outcomes):
    for row in claims(PATH, **tables).itertuples():
        for part, verdict in (("published", row.verdict), ("beyond", row.verdict_beyond)):
            mine = outcomes[(outcomes.claim == row.claim) & (outcomes.part == part)]
            mine = mine[mine.decides]
            assert combined(list(mine.verdict)) == verdict


def test_words_tell_the_tests_of_a_part_apart(outcomes):
    assert not outcomes.duplicated(["claim", "part", "what"]).any()
