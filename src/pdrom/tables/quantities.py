"""Kinds of quantities that a column may hold: how far two runs on two machines may differ in it.

How far is measured, see `pdrom.verification`; which kind a column is, it says itself or its type.
"""

from typing import Literal

Quantity = Literal[
    "exact", "verdict", "value", "error", "run", "gain", "drift", "magnitude", "count", "tally",
    "share", "fragile", "ratio", "time", "clocked", "told",
    "rounding",
]  # fmt: skip

QUANTITIES: dict[Quantity, str] = {
    "exact": "names, parameters, sizes and truth values: equal",
    "verdict": "verdicts on claims: equal, but where times decide and lie close to the limit",
    "value": "well-conditioned numbers",
    "error": "errors; above 0.1 they count as failed, and only that is compared",
    "run": "what else a run tells of itself; not compared where the run failed",
    "gain": "amplification; not compared where it exceeds what double precision resolves",
    "drift": "sensitivity: drift of perturbed runs, how an iteration treats a small error",
    "magnitude": "numbers made of rounding errors, or picked between two runs: the magnitude",
    "count": "numbers of samples, which rounding may pick",
    "tally": "how many runs fail, or obey",
    "share": "shares, probabilities and correlations over runs",
    "fragile": "verdicts and outcomes near a limit: all but a few are equal",
    "ratio": "ratios of times: the column as a whole",
    "time": "times, rates and memory: not comparable between machines",
    "clocked": "what a clock, a compiler or a cache chooses: not comparable between machines",
    "told": "words about numbers that other columns hold: not compared",
    "rounding": "what is made of rounding errors, or not, by rounding errors: not compared",
}

# Units of what a clock (or the memory in use) measures.
_CLOCK_UNITS = ("s", "ms", "us", "ns", "GB/s", "1e9/s", "MB")


def usual_quantity(kind: str, name: str, unit: str, timed: bool) -> Quantity:
    """What a column is that does not say it: by its type, its unit, and words in its name."""
    if kind != "number":
        return "clocked" if timed else "exact"
    if not timed:
        is_gain = name.startswith("gain")
        return "error" if "error" in name else "gain" if is_gain else "value"
    if unit in _CLOCK_UNITS:
        return "time"
    # of an interval of times the ends say little: a neighbour on the machine moves them
    chosen = "error" in name or name.endswith(("_low", "_high"))
    return "clocked" if chosen else "ratio"
