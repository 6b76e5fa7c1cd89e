"""Rule hard_cases: every reduction in the hard cases, and the accuracy of the kernels."""

import logging
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.store import write_table
from pdrom.experiments.hard_cases.accuracy import kernel_accuracy
from pdrom.experiments.hard_cases.catalogue import CASES
from pdrom.experiments.hard_cases.expectations import load_expectations, surprise
from pdrom.experiments.hard_cases.outcomes import rows
from pdrom.reduction.method import MethodSpec

log = logging.getLogger(__name__)

COLUMNS = [
    "case", "method", "k", "r", "gain", "frames", "finite", "blowup_frame", "max_extent",
    "objective_rise", "outcome", "why",
]  # fmt: skip


def run_hard_cases(
    methods: dict[str, dict[str, Any]],
    cases: list[str],
    matrices: int,
    expectations: str,
    cases_output: str,
    kernels_output: str,
) -> None:
    """Write the tables hard_cases and kernel_accuracy.

    Parameters
    ----------
    matrices : per class, for the accuracy of the kernels
    """
    specs = {name: MethodSpec.model_validate(spec) for name, spec in methods.items()}
    expected = load_expectations(Path(expectations))
    found = []
    for name in cases:
        for row in rows(CASES[name], specs, expected):
            found.append(row)
            contradiction = surprise(row["outcome"], name, expected.get(row["method"]))
            if contradiction:
                log.warning("%s, %s: %s", name, row["method"], contradiction)
        log.info("%s: done", name)
    whole = dict.fromkeys(["k", "r", "frames", "blowup_frame"], "Int64")
    write_table(pd.DataFrame(found, columns=COLUMNS).astype(whole), cases_output)
    write_table(pd.DataFrame(kernel_accuracy(matrices)), kernels_output)
