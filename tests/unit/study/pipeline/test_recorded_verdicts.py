"""The record of the verdicts on another sample, and the table that reads it."""

from pathlib import Path

import pandas as pd

from pdrom.core.store import write_table
from places import ROOT
from study.pipeline.tracked import recorded_verdicts
from study.tables.claims.claims import claims
from study.tables.claims.rules import load_claims
from study.tables.claims.verdicts import MEASURED, RECORDED, RULES, replication


def verdicts(**columns: str) -> pd.DataFrame:
    made = pd.DataFrame({"claim": ["C1", "C5"], **dict.fromkeys(MEASURED, "holds"), **columns})
    return made.reindex(columns=claims.column_names)


def test_another_verdict_is_not_the_same(tmp_path: Path) -> None:
    write_table(claims.checked(verdicts()), tmp_path / "claims.csv")
    recorded = recorded_verdicts(tmp_path / "claims.csv", ROOT / RULES)
    recorded.to_csv(tmp_path / "kept.csv", index=False)
    today = verdicts(verdict_beyond="does not hold")
    table = replication.checked(replication(today, ROOT / RULES, tmp_path / "kept.csv"))
    assert table.same.tolist() == [True, True, False, False]
    assert table.rules_unchanged.all()
    other = recorded.assign(rules=["00000000", recorded.rules[1]])
    other.to_csv(tmp_path / "kept.csv", index=False)
    table = replication(today, ROOT / RULES, tmp_path / "kept.csv")
    assert table.rules_unchanged.tolist() == [False, True, False, True]


def test_the_kept_record_has_every_claim() -> None:
    assert pd.read_csv(ROOT / RECORDED).claim.tolist() == list(load_claims(ROOT / RULES))
