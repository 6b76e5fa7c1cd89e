"""What must hold in the full-order run of every hard case."""

import pytest

from hard_cases import parameters
from study.experiments.hard_cases.catalogue import CASES
from study.experiments.hard_cases.record import CHECKS, faults


@pytest.mark.parametrize("name", parameters(CASES))
def test_everything_holds(name):
    assert faults(CASES[name]) == []


@pytest.mark.parametrize("name", CASES)
def test_a_case_says_why_and_what(name):
    case = CASES[name]
    assert case.name == name
    assert len(case.why) > 10
    assert case.holds == ("refused",) or {"finite", "objective"} <= set(case.holds) <= set(CHECKS)
