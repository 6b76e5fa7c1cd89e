"""Table replication: the verdicts of the study beside those on another sample, as recorded once."""

from pathlib import Path

import pandas as pd

from study.artifact.reads import ProjectFile, TableOf
from study.tables.claims.rules import PARTS, load_claims
from study.tables.claims.verdicts import VERDICTS
from study.tables.kit.declaration import compared, flag, table, text, timed

RULES = "config/claims.yaml"
RECORDED = "config/reference/replication/claims.csv"
MEASURED = [f"{name}{suffix}" for suffix in PARTS.values() for name in ("verdict", "measured")]


@table(
    title="Verdicts on another sample of the scenes, by the same rules",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("part", f"which verdict: {', '.join(PARTS)}"),
        compared("exact", timed(text("verdict", f"of this study, one of: {', '.join(VERDICTS)}"))),
        text("verdict_replication", "of config/replication.yaml, recorded"),
        compared("exact", timed(flag("same", "the two agree"))),
        compared("skipped", timed(text("measured", "range of the tests that decide"))),
        text("measured_replication", "the same range there"),
        flag("rules_unchanged", "the rules are those by which the record was decided"),
        text("date", "day of the record"),
    ),
    reads={
        "claims": TableOf("claims"),
        "rules": ProjectFile(RULES),
        "recorded": ProjectFile(RECORDED),
    },
)
def replication(claims: pd.DataFrame, rules: Path, recorded: Path) -> pd.DataFrame:
    """One row per claim and part that the study decides and the record holds."""
    loaded = load_claims(rules)
    both = claims.merge(pd.read_csv(recorded), on="claim", suffixes=("", "_recorded"))
    rows = []
    for part, suffix in PARTS.items():
        now, then = both[f"verdict{suffix}"], both[f"verdict{suffix}_recorded"]
        rows.append(
            pd.DataFrame(
                {
                    "claim": both.claim,
                    "part": part,
                    "verdict": now,
                    "verdict_replication": then,
                    "same": now == then,
                    "measured": both[f"measured{suffix}"],
                    "measured_replication": both[f"measured{suffix}_recorded"],
                    "rules_unchanged": [
                        loaded[claim].fingerprint == rule
                        for claim, rule in zip(both.claim, both.rules, strict=True)
                    ],
                    "date": both.date,
                }
            )
        )
    return pd.concat(rows, ignore_index=True)
