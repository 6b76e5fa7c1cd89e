"""Hard cases as test parameters; the slow ones carry the marker."""

from collections.abc import Iterable
from functools import cache

import pytest

from pdrom.core.yamlfile import read_yaml
from pdrom.reduction.method import load_methods
from places import ROOT
from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.outcomes import HardCases, Training

METHODS = load_methods(ROOT / "config" / "methods.yaml")
EXPECTED = HardCases(**read_yaml(ROOT / "config" / "default.yaml")["hard_cases"]).expected


def parameters(names: Iterable[str]) -> list:
    """Cases as test parameters."""
    marks = {name: [pytest.mark.slow] if CASES[name].slow else [] for name in names}
    return [pytest.param(name, marks=marks[name], id=name) for name in names]


@cache
def training(case: str) -> Training:
    """The full-order run of a case, made once."""
    return Training(CASES[case])
