"""Methods, expected outcomes and full-order runs of the hard cases."""

from functools import cache

from pdrom.core.yamlfile import read_yaml
from pdrom.reduction.method import load_methods
from places import ROOT
from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.outcomes import HardCases, Training

METHODS = load_methods(ROOT / "config" / "methods.yaml")
EXPECTED = HardCases(**read_yaml(ROOT / "config" / "default.yaml")["hard_cases"]).expected


@cache
def training(case: str) -> Training:
    """The full-order run of a case, made once."""
    return Training(CASES[case])
