"""The checks that the full-order run of every hard case must pass."""

import pytest

from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.record import faults

NAMES = [pytest.param(n, marks=[pytest.mark.slow] if c.slow else []) for n, c in CASES.items()]


@pytest.mark.parametrize("name", NAMES)
def test_everything_holds(name):
    case = CASES[name]
    assert case.holds == ("refused",) or {"finite", "objective"} <= set(case.holds)
    assert faults(case) == []
