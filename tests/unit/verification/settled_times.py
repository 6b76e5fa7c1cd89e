"""Expected tables whose speed-ups are set: those of a small study change from run to run."""

import numpy as np
import pandas as pd

from pdrom.report.claims import claims_rows, load_claims
from pdrom.verification.settings import RULES
from places import ROOT

CLAIM, PART = "C11", "beyond"
WHOLE = load_claims(ROOT / RULES)[CLAIM]
(DECIDING,) = (test for test in WHOLE.beyond if test.decides)
PUBLISHED = tuple(test for test in WHOLE.published if test.decides)
RULE = WHOLE.model_copy(update={"published": PUBLISHED, "beyond": (DECIDING,)})
ERROR = "relative_error_within_horizon"
# so many of the runs lose against the full order
LOSING = 2
CHANGED = ("claims", "reduced_reruns")


def deciding_runs(tables: dict[str, pd.DataFrame]) -> pd.Index:
    """The runs that the verdict rests on, accurate ones with a speed-up."""
    table = tables["reduced_reruns"]
    chosen = np.logical_and.reduce([table[c].isin(v) for c, v in DECIDING.where.items()])
    return table[chosen & (table.position_basis == "full") & (table[ERROR] <= 0.1)].index


def settled(tables: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Tables with speed-ups on both sides of one, from 0.9 to 2, and the verdict that follows."""
    runs = deciding_runs(tables)
    speedup = tables["reduced_reruns"].speedup.copy()
    speedup[runs] = [
        *np.linspace(0.9, 0.95, LOSING), *np.linspace(1.05, 2.0, len(runs) - LOSING)
    ]  # fmt: skip
    return with_runs(tables, speedup=speedup)


def with_runs(tables: dict[str, pd.DataFrame], **columns: pd.Series) -> dict[str, pd.DataFrame]:
    """The tables with other columns of the runs, and the verdicts that follow."""
    tables = {**tables, "reduced_reruns": tables["reduced_reruns"].assign(**columns)}
    (row,) = claims_rows({CLAIM: RULE}, tables).to_dict("records")
    claims = tables["claims"].copy()
    claims.loc[claims.claim == CLAIM, ["verdict", "verdict_beyond"]] = [
        row["verdict"], row["verdict_beyond"],
    ]  # fmt: skip
    return {**tables, "claims": claims}
