"""Verdicts on the preprint's claims, by rules of config/claims.yaml that code evaluates.

A claim is decided twice, as published and beyond, each time by tests: a metric over chosen rows of
the tables, compared with a threshold. Tests marked ``decides`` give the verdict, the others stand
beside it in the reason.
"""

from study.tables.claims.metrics import METRICS, Metric
from study.tables.claims.outcomes import FOUND, outcome_rows
from study.tables.claims.rows import Tables
from study.tables.claims.rules import ClaimRule, TestRule, load_claims
from study.tables.claims.verdicts import (
    DEPENDS,
    FAILS,
    HOLDS,
    MACHINE,
    UNDECIDED,
    VERDICTS,
    Outcome,
    answer,
    answer_of,
    claims_rows,
    close,
    combined,
    evaluate,
    is_timed,
    satisfied,
    timed_columns,
    values_of,
)

__all__ = [
    "DEPENDS", "FAILS", "FOUND", "HOLDS", "MACHINE", "METRICS", "UNDECIDED", "VERDICTS",
    "ClaimRule", "Metric", "Outcome", "Tables", "TestRule", "answer", "answer_of", "claims_rows",
    "close", "combined", "evaluate", "is_timed", "load_claims", "outcome_rows", "satisfied",
    "timed_columns", "values_of",
]  # fmt: skip
