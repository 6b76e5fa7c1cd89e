"""Table claims: the verdicts on the preprint's claims, with the rules of config/claims.yaml."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from study.tables.claims.metrics import Tables
from study.tables.claims.rules import (
    NONE_ADDED,
    PARTS,
    READS,
    Added,
    ClaimRule,
    TestRule,
    load_claims,
)
from study.tables.claims.verdicts import VERDICTS, combined, evaluate
from study.tables.kit.declaration import compared, text, timed
from study.tables.kit.declaration import table as declare

# What the rule of a claim says of it.
WORDS = {"source", "paper", "figure_or_table", "section", "shown", "text", "qualifiers"}


def timed_columns(rule: ClaimRule) -> set[str]:
    """Columns of the row of a ``rule`` that depend on timing: two runs may differ there."""
    found: set[str] = set()
    for part, suffix in PARTS.items():
        timed = [test for test in getattr(rule, part) if test.timed]
        if timed:
            found.add(f"why{suffix}")
        if any(test.decides for test in timed):
            found |= {f"{name}{suffix}" for name in ("measured", "verdict", "condition")}
            found.add("answer")
    return found


def _timed_cells(table: pd.DataFrame, **files: Path) -> list[set[str]]:
    loaded = load_claims(files["rules"])
    return [timed_columns(loaded[claim]) for claim in table.claim]


@declare(
    title="Verdicts on the claims of the preprint",
    columns=(
        text("claim", "its identifier in config/claims.yaml"),
        text("source", "who claims it"),
        text("paper", "what the preprint says"),
        compared(
            "skipped",
            timed(text("measured", "range of what was measured, of the tests that decide")),
        ),
        compared("exact", timed(text("verdict", f"as published, one of: {', '.join(VERDICTS)}"))),
        compared("skipped", timed(text("why", "all tests in words"))),
        text("figure_or_table", "where to see it"),
        text("section", "section of the preprint"),
        text("shown", "figures of the preprint"),
        text("text", "the claim in our words"),
        text("qualifiers", "what a fair test has to keep"),
        compared("skipped", timed(text("condition", "what the verdict depends on"))),
        compared(
            "skipped",
            timed(text("measured_beyond", "the same of sound variants on well-posed scenes")),
        ),
        compared("exact", timed(text("verdict_beyond", "the verdict there"))),
        compared("skipped", timed(text("condition_beyond", "what it depends on"))),
        compared("skipped", timed(text("why_beyond", "all tests there in words"))),
        compared("skipped", timed(text("answer", "both verdicts in words"))),
        text("history", "when and why the rules became what they are"),
    ),
    reads=READS,
    timed_cells=_timed_cells,
)
def claims(rules: Path, added: Added = NONE_ADDED, **tables: pd.DataFrame) -> pd.DataFrame:
    """One row per claim, in the order of the file ``rules``; see `claims_rows`."""
    return claims_rows(load_claims(rules, added), tables)


def claims_rows(rules: Mapping[str, ClaimRule], tables: Tables) -> pd.DataFrame:
    """Rows of the table claims from ``rules`` and ``tables``, in the order of the file."""
    return pd.DataFrame([_row(name, rule, tables) for name, rule in rules.items()])


def _row(name: str, rule: ClaimRule, tables: Tables) -> dict[str, Any]:
    published, beyond = _decided(rule.published, tables), _decided(rule.beyond, tables)
    return {
        "claim": name,
        **rule.model_dump(include=WORDS),
        **published,
        **{f"{key}_beyond": value for key, value in beyond.items()},
        "answer": f"as published it {published['verdict']}, beyond it {beyond['verdict']}",
        "history": " ".join(
            f"{change.date.isoformat()}{' (results were known)' * change.after_data}: "
            f"{change.reason}"
            for change in rule.changes
        ),
    }


def _decided(tests: Sequence[TestRule], tables: Tables) -> dict[str, str]:
    outcomes = [(test, evaluate(test, tables)) for test in tests]
    deciding = [o for test, o in outcomes if test.decides]
    return {
        "measured": "; ".join(o.measured for o in deciding),
        "verdict": combined([o.verdict for o in deciding]),
        "condition": "; ".join(o.condition for o in deciding if o.condition),
        "why": "; ".join(o.sentence for _, o in outcomes) + ".",
    }
