"""Specifications of methods refuse combinations that do not exist."""

import pytest
from pydantic import ValidationError

from pdrom.reduction.method import MethodSpec


@pytest.mark.parametrize(
    "fault",
    [
        {"rows": "joint", "selection": "pivoted-qr"},
        {"rows": "element", "solve": "square"},
        {"rows": "joint", "solve": "square", "coefficients": "shared"},
        {"rows": "scalar", "layout": "per-axis"},
        {"rows": "element", "centring": "mean-in-modes", "coefficients": "shared"},
        {"rows": "scalar", "coefficients": "per-axis"},
        {"rows": "joint", "selection": "s-opt"},
        {"rows": "scalar", "solve": "square", "oversampling": 2},
        {"rows": "joint", "solve": "square", "oversampling": 2},
        {"rows": "scalar", "solve": "square", "gain_bound": 2.0},
        {"rows": "all", "gain_bound": 2.0},
        {"rows": "joint", "gain_bound": 2.0},
        {"rows": "element", "coefficients": "per-axis", "gain_bound": 2.0},
        {"rows": "joint", "solve": "square", "repeat_rows": True},
        {"rows": "all", "oversampling": 3},
    ],
)
def test_combinations_that_do_not_exist_are_refused(fault):
    with pytest.raises(ValidationError):
        MethodSpec(title="t", **fault)
