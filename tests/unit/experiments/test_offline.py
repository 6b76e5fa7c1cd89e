"""Offline algorithms at small size: the rows of the table, and agreement with pyMOR."""

import numpy as np
import pytest

from pdrom.core.paths import File
from pdrom.core.store import read_table
from pdrom.experiments.offline import Offline, decaying, offline

SMALL = {"rows": 400, "snapshots": 12, "r": 12, "elements": 300, "equations": 40}


def test_every_algorithm_has_a_row_and_agrees_with_pymor(tmp_path):
    path = tmp_path / "offline.csv"
    offline(sizes=Offline(**SMALL), out=File(str(path), {}))
    table = read_table(path)
    pairs = list(zip(table.task, table.implementation, strict=True))
    assert pairs == [
        ("deim", "pdrom"), ("deim", "pymor"), ("nnls", "pdrom"), ("pod", "pdrom"), ("pod", "pymor"),
        ("q-deim", "pdrom"),
    ]  # fmt: skip
    assert (table.seconds > 0.0).all()
    found = table.set_index(["task", "implementation"]).difference
    assert found["pod", "pdrom"] < 1e-12
    assert found["deim", "pdrom"] == 0.0


def test_singular_values_of_the_matrix_decay_as_asked(rng):
    sigma = np.linalg.svd(decaying(rng, 5000, 8, 1e-6), compute_uv=False)
    assert sigma == pytest.approx(np.geomspace(1.0, 1e-6, 8), rel=0.1)


def test_more_modes_than_snapshots_are_refused():
    with pytest.raises(ValueError, match="r = 12: at most snapshots = 5"):
        Offline(**{**SMALL, "snapshots": 5})
