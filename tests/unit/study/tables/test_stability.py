"""Table `stability`: outcomes against their definition, one row for every run."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import write_hdf5
from study.artifact import paths
from study.tables.reduced_reruns import outcomes, stability

RERUN = {"scene": "a", "group": "spring", "frames": 9, "finite": True, "blowup_frame": None,
         "max_extent": 1.1, "relative_error": 7.0, "energy_ratio": 1.0, "gain": 2.0}  # fmt: skip
FULL = {
    "experiment": "rerun", "scene": "a", "h": 0.016, "stiffness_ratio": 1.0, "method": "full",
    "position_basis": "full", "finite": True, "max_extent": 1.2, "relative_error": 0.0,
}  # fmt: skip


def test_every_run_has_one_row_with_its_outcome(tmp_path):
    """One scene with three sizes of one method, two subspace runs, and a sweep of two rows."""
    positions = np.zeros((4, 2, 3))
    positions[:, 1, 0] = [1.0, 1.1, 1.2, 0.9]
    fom = tmp_path / "fom" / "a" / "train.h5"
    with write_hdf5(fom) as file:
        file["positions"] = positions
    local = pd.DataFrame(
        [
            RERUN | {"method": "deim", "r": 6},
            RERUN | {"method": "deim", "r": 10, "finite": False, "blowup_frame": 3},
            {"scene": "a", "group": "spring", "method": "deim", "r": 20, "frames": 0},
        ]
    )
    inside = pd.DataFrame(
        [RERUN | {"group": "all", "method": "full", "position_basis": "pod", "k": k, "r": 50}
         for k in (10, 20)]
    ).drop(columns="gain")  # fmt: skip
    own = {"method": "deim", "r": 6, "group": "spring", "relative_error": 0.3}
    rows = [FULL | {"h": 0.2, "frames": 5}, FULL | {"h": 0.2} | own]
    sweep = pd.DataFrame(rows).drop(columns="experiment")
    sweep = sweep.assign(blowup_frame=None, energy_ratio=1.0, gain=None, k=None)
    given = {"reruns": local, "subspaces": inside, "sweeps": sweep}
    judged = pd.concat([local.assign(position_basis="full", k=np.nan), inside])
    errors = [0.05, None, None, 0.01, 0.5]
    judged = judged.assign(relative_error_within_horizon=errors, motion="train")
    limits = {"time_steps": {"a": 0.016}, "wrong": 0.1, "departure": 2.0}
    read = {"full_order": [paths.TRAIN.file(str(fom))], **given, **limits}
    read["reduced_reruns"] = judged
    table = stability(**read)
    assert table.outcome.tolist() == [
        "accurate", "accurate", "blow-up", "not run", "accurate", "wrong", "accurate", "wrong",
    ]  # fmt: skip
    assert table.experiment.tolist() == ["rerun"] * 6 + ["sweep"] * 2
    assert table.h.tolist() == [0.016] * 6 + [0.2] * 2
    assert table.stiffness_ratio.tolist()[:6] == [1.0] * 6
    full = table[(table.method == "full") & (table.position_basis == "full")]
    assert full.max_extent.tolist() == [1.2, 1.2]
    assert (full.energy_ratio == 1.0).all()
    keys = ["experiment", "scene", "h", "stiffness_ratio", "method", "position_basis", "k", "r"]
    assert not table.duplicated(keys).any()
    # errors cover the frames within the horizon
    rerun = table[(table.experiment == "rerun") & (table.method == "deim")]
    assert rerun.relative_error.tolist()[0] == 0.05
    assert rerun.relative_error.isna().tolist() == [False, True, True]

    judged = judged.query("position_basis == 'full'")
    none = dict.fromkeys(("subspaces", "sweeps"), pd.DataFrame())
    table = stability(**read | none | {"reduced_reruns": judged})
    assert table.outcome.tolist() == ["accurate", "accurate", "blow-up", "not run"]


@pytest.mark.parametrize(
    ("finite", "extent", "error", "expected"),
    [
        (None, 3.0, 0.5, "not run"),
        (0.0, 3.0, 0.5, "blow-up"),  # columns of numbers with missing values
        (False, 3.0, None, "blow-up"),
        (True, 2.5, None, "left the scene"),
        (1.0, 2.4, None, "not judged"),
        (True, 2.4, 0.11, "wrong"),
        (True, 2.4, 0.1, "accurate"),
    ],
)
def test_an_outcome_is_the_most_severe_one_that_applies(finite, extent, error, expected):
    row = FULL | {"method": "m", "finite": finite, "max_extent": extent, "relative_error": error}
    assert outcomes(pd.DataFrame([FULL, row]), 0.1, 2.0)[1] == expected
