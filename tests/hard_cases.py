"""Hard cases as test parameters; the slow ones carry the marker."""

from collections.abc import Iterable
from functools import cache

import pytest

from pdrom.reduction.method import load_methods
from places import ROOT
from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.expectations import load_expectations
from study.experiments.hard_cases.reductions import Training

METHODS = load_methods(ROOT / "config" / "methods.yaml")
EXPECTED = load_expectations(ROOT / "config" / "hard_cases.yaml")


def parameters(names: Iterable[str]) -> list:
    """Cases as test parameters."""
    marks = {name: [pytest.mark.slow] if CASES[name].slow else [] for name in names}
    return [pytest.param(name, marks=marks[name], id=name) for name in names]


@cache
def training(case: str) -> Training:
    """The full-order run of a case, made once."""
    return Training(CASES[case])
