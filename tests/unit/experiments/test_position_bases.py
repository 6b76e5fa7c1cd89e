"""Best approximations in a subspace, and how far a flat sheet leaves its plane."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.paths import POSITION_BASES
from pdrom.core.store import write_table
from pdrom.experiments.position_bases import COLUMNS, best_differences, flat_axis, out_of_plane
from pdrom.tables.position_bases import position_bases


def test_the_best_approximation_is_that_of_least_squares(rng):
    columns, positions = rng.standard_normal((9, 4)), rng.standard_normal((5, 9, 3))
    found = best_differences(columns, positions)
    for difference, q in zip(found, positions, strict=True):
        z = np.linalg.lstsq(columns, q, rcond=None)[0]
        assert difference == pytest.approx(np.linalg.norm(q - columns @ z))


def test_only_flat_shapes_have_a_plane_to_leave(rng):
    points = rng.standard_normal((8, 3))
    assert flat_axis(points) is None
    points[:, 1] = 0.3
    assert flat_axis(points) == 1
    steps = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [0.0, 5.0, 0.0]])
    motion = points + steps[:, None]
    assert out_of_plane(motion, 1, 1) == pytest.approx(0.8)
    assert out_of_plane(motion, 1, 2) == pytest.approx(np.sqrt((16 + 25) / 50))
    assert out_of_plane(motion, None, 2) is None
    assert out_of_plane(motion[:1], 1, 0) is None


def test_pairs_of_bases_are_compared_size_by_size(tmp_path):
    rows = [
        ("calm", split, basis, k, best, error, None, None)
        for split in ("train", "heldout")
        for basis, k, best, error in (
            ("pod", 10, 0.01, 0.04),
            ("pod", 20, 0.02, 0.03),
            ("skinning", 10, 0.02, 0.03),
            ("skinning", 20, 0.01, None),
        )
    ]
    path = POSITION_BASES.at(str(tmp_path), scene="calm")
    write_table(pd.DataFrame(rows, columns=COLUMNS), path)
    made = position_bases([POSITION_BASES.file(path)])
    train = made[made.split == "train"].set_index(["position_basis", "k"])
    assert train.loc[("pod", 10), "ratio"] == pytest.approx(4.0)
    assert train.loc[("pod", 10), "loses"]
    assert not train.loc[("pod", 10), "best_loses"]
    assert pd.isna(train.loc[("pod", 20), "loses"])
    assert train.loc[("pod", 20), "best_loses"]
    assert train.loc["skinning"].loses.isna().all()
