"""Selections of a method's samples, by name; the code of one is loaded when a method uses it."""

from pdrom.core.registry import Registry

SELECTIONS = Registry(
    "selection",
    {
        "greedy": "pdrom.reduction.sampling.greedy:Greedy",
        "pivoted-qr": "pdrom.reduction.sampling.qdeim:PivotedQR",
        "s-opt": "pdrom.reduction.sampling.s_opt:SOpt",
    },
)
