"""Table requested_tolerances: which requests count as met, and which of these are broken."""

import pandas as pd

from pdrom.core.store import write_table
from study.artifact.paths import REQUESTED_TOLERANCES
from study.experiments.requested_tolerances import COLUMNS
from study.tables.accuracy_cost import requested_tolerances

ROW = {
    "scene": "s", "motion": "heldout", "tolerance": 0.05, "vertices": 9, "frames": 8,
    "reduced": True, "error": 0.04, "ms_per_frame": 0.1, "full_ms": 0.2, "own_ms": 0.4,
}  # fmt: skip


def test_a_request_is_broken_where_it_counts_as_met_and_the_error_is_larger(tmp_path):
    rows = [ROW, ROW | {"error": 0.06}, ROW | {"frames": 0, "error": 0.06, "reduced": False}]
    path = REQUESTED_TOLERANCES.at(str(tmp_path), scene="s")
    write_table(pd.DataFrame(rows, columns=COLUMNS), path)
    made = requested_tolerances([REQUESTED_TOLERANCES.file(path)])
    assert made.met.tolist() == [True, True, False]
    assert made.broken.tolist() == [False, True, False]
    assert made.over_full.tolist() == [0.5] * 3
    assert made.over_own.tolist() == [0.25] * 3
