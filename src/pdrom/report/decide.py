"""Rule claims: tables and rules -> verdicts."""

from pathlib import Path

from pdrom.core.store import read_table, write_table
from pdrom.report.claims import claims_table, load_claims


def decide_claims(rules: str, tables: list[str], output: str) -> None:
    """Evaluate config/claims.yaml on the tables."""
    read = {Path(path).stem: read_table(path) for path in tables}
    write_table(claims_table(load_claims(Path(rules)), read), output)
