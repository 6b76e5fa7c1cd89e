"""Specifications of methods: presets, combinations that exist, faults that are named."""

import pytest
from pydantic import ValidationError

from pdrom.reduction.method import MethodSpec, load_methods
from places import CONFIG


def test_presets_are_the_methods_of_the_literature():
    methods = load_methods(CONFIG / "methods.yaml")
    chosen = {
        name: (m.weighting, m.centring, m.layout, m.rows, m.selection, m.solve, m.repeat_rows)
        for name, m in methods.items()
        if m.rows != "all"
    }
    affine = ("none", "affine", "vectorised")
    literature = {
        "deim": (*affine, "scalar", "greedy", "square", False),
        "qdeim": (*affine, "scalar", "pivoted-qr", "square", False),
        "deim-joint": ("none", "none", "vectorised", "joint", "greedy", "square", False),
        "published": (
            "none", "mean-in-modes", "vectorised", "joint", "greedy", "tikhonov", True,
        ),
        "block-deim": (*affine, "element", "greedy", "qr", False),
        "block-qdeim": (*affine, "element", "pivoted-qr", "qr", False),
        "gappy": (*affine, "element", "greedy", "qr", False),
        "bounded": (*affine, "element", "greedy", "qr", False),
        "s-opt": (*affine, "scalar", "s-opt", "square", False),
        "block-s-opt": (*affine, "element", "s-opt", "qr", False),
    }  # fmt: skip
    assert {name: chosen[name] for name in literature} == literature
    assert methods["pod"].rows == "all"
    assert methods["published"].tikhonov == 1e-8
    # those with the same basis share its name
    assert methods["deim"].basis_id == methods["block-deim"].basis_id == "none-affine-vectorised"
    assert methods["published"].basis_id == "none-mean-in-modes-vectorised"
    # more joint rows than modes are solved by least squares
    assert MethodSpec(title="t", rows="joint", solve="qr", oversampling=2).oversampling == 2


@pytest.mark.parametrize(
    "fault",
    [
        {"rows": "joint", "selection": "pivoted-qr"},
        {"rows": "element", "solve": "square"},
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
        {"rows": "element", "gain_bound": 1.0},
        {"rows": "joint", "solve": "square", "repeat_rows": True},
        {"rows": "vertices"},
        {"rows": "all", "oversampling": 3},
        {"rows": "all", "tikhonov": 0.0},
        {},
    ],
)
def test_combinations_that_do_not_exist_are_refused(fault):
    with pytest.raises(ValidationError):
        MethodSpec(title="t", **fault)
