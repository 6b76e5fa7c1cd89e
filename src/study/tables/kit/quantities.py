"""Six kinds of what a column may hold, and how far two machines may differ in each.

The tolerances are chosen from measurements, see docs/decisions/0010-six-kinds.md.
"""

from typing import Literal

Quantity = Literal["exact", "value", "error", "share", "timed", "skipped"]

QUANTITIES: dict[Quantity, str] = {
    "exact": "names, parameters, sizes, truth values: equal",
    "value": "well-conditioned numbers, and numbers of samples: relative",
    "error": "how runs and approximations end: relative, words and frames equal",
    "share": "shares, correlations and numbers of runs over many: absolute",
    "timed": "what depends on timing, a compiler or a cache: not judged",
    "skipped": "rounding errors, and words about other columns: not compared",
}
# How far one cell may be off, where its column says nothing else.
TOLERANCES: dict[Quantity, float] = {"exact": 1e-8, "value": 1e-4, "error": 0.05, "share": 0.1}
# The same of numbers of runs over many.
TALLY = 2.0


def usual_quantity(kind: str, name: str, timed: bool) -> Quantity:
    """Kind of a column that declares none: by its type (``kind``, ``timed``) and ``name``."""
    if timed:
        return "timed"
    if kind != "number":
        return "exact"
    return "error" if "error" in name else "value"
