"""Rates of the machine: what is measured, and what the system tells of its caches."""

import numpy as np

from study.experiments.roofline.bound import DIVISIONS, FLOPS, READ, ROOTS
from study.experiments.roofline.rates import COLUMNS, SMALLEST_SET, caches, rates


def test_every_size_and_operation_has_a_rate_between_its_quartiles():
    rows = rates(4 * SMALLEST_SET, 1e-6, 3)
    assert all(set(row) <= set(COLUMNS) for row in rows)
    assert [row["quantity"] for row in rows] == [READ] * 3 + [FLOPS, DIVISIONS, ROOTS]
    assert [row["working_set"] / SMALLEST_SET for row in rows[:3]] == [4, 2, 1]
    for row in rows:
        assert 0.0 < row["low"] <= row["rate"] <= row["high"] < np.inf


def test_caches_of_data_are_read_from_the_system(tmp_path):
    told = {"index0": ("Data", "48K", "1"), "index1": ("Instruction", "64K", "1"),
            "index2": ("Unified", "2048K", "2")}  # fmt: skip
    for name, values in told.items():
        (tmp_path / name).mkdir()
        for key, value in zip(("type", "size", "level"), values, strict=True):
            (tmp_path / name / key).write_text(value + "\n")
    assert caches(tmp_path) == [("L1", 48 * 1024), ("L2", 2048 * 1024)]
    assert caches(tmp_path / "nowhere") == []
