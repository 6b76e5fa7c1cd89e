"""The table of tolerances, from the tables of a plain run and of its variants."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from pdrom.core.store import read_table, write_table
from pdrom.pipeline.tables import all_tables
from pdrom.report.claims import load_claims
from pdrom.verification.settings import RULES, load_settings
from pdrom.verification.spread import Spread, comparisons, spreads
from pdrom.verification.times import timed_spreads
from pdrom.verification.tolerances import derived

DIGITS = 3


def derive(plain: Sequence[str], variants: Mapping[str, Sequence[str]], output: str) -> None:
    """Write the tolerances.

    Parameters
    ----------
    plain : tables of the plain run
    variants : tables of every variant, by its name
    """
    expected, rules = _tables(plain), load_claims(RULES)
    found: dict[str, list[Spread]] = {}
    for name, paths in variants.items():
        tables = _tables(paths)
        compared = comparisons(all_tables(), expected, tables).values()
        found[name] = [spread for comparison in compared for spread in spreads(comparison)]
        found[name] += timed_spreads(rules, expected, tables)
    made = derived(found, load_settings())
    numbers = made.select_dtypes("float").map(lambda value: float(f"{value:.{DIGITS}g}"))
    write_table(made.assign(**numbers), output)


def _tables(paths: Sequence[str]) -> dict[str, pd.DataFrame]:
    known = all_tables()
    return {Path(path).stem: known[Path(path).stem].checked(read_table(path)) for path in paths}
