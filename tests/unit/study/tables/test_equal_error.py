"""Tables `equal_error` and `frontier`: comparisons and best settings, worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from builders import frame
from pdrom.core.store import write_table
from pdrom.model.held_out import MOTIONS
from study.artifact.paths import File
from study.tables.alternatives import KEYS, alternatives
from study.tables.equal_error import equal_error, frontier

COLUMNS = (
    "method vertices iterations training_motions k skinning tolerance error_implicit ms_per_frame"
)
NO_MODEL = (None,) * 4
# On the mesh of 9 vertices and a coarser mesh of 4; rows that are not simulated have no time.
RUNS = frame(
    COLUMNS,
    ("converged", 9, None, *NO_MODEL, 0.0, None),
    ("converged", 4, None, *NO_MODEL, 0.02, None),
    ("playback", 9, None, *NO_MODEL, 0.9, None),
    ("projective", 9, 1, *NO_MODEL, 0.3, 2.0),
    ("projective", 9, 10, *NO_MODEL, 0.01, 8.0),
    ("chebyshev", 9, 5, *NO_MODEL, 0.04, 6.0),
    ("coarser-mesh", 4, 2, *NO_MODEL, 0.05, 1.0),
    ("coarser-mesh-anderson", 4, 5, *NO_MODEL, 0.2, 1.5),
    ("ecsw", 9, 5, 1, 38, 0, 1e-2, 0.05, 0.5),
    ("ecsw", 9, 5, 1, 20, 0, 1e-2, 0.1, 0.25),  # not the fixed setting, as in the next four rows
    ("ecsw", 9, 10, 1, 38, 0, 1e-2, 0.04, 1.0),
    ("ecsw", 9, 5, 4, 38, 0, 1e-2, 0.03, 0.5),
    ("ecsw", 9, 5, 1, 38, 10, 1e-2, 0.03, 0.5),
    ("ecsw", 9, 5, 1, 38, 0, 1e-3, 0.03, 0.5),
    ("ecsw-newton", 9, None, 2, 38, 0, 1e-2, 0.005, 4.0),
)
CASES = {"heldout": 1.0, "kick": 1.0, "stiffness": 0.5, "validation_1": 1.0, "validation_2": 3.0}


def made(folder, *recorded, runs=RUNS, cases=CASES, **changes) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Table alternatives of the runs in each case, whose errors are multiplied, and its times.

    The second process is twice as slow; reduced models have these times in the first trajectory and
    twice these in others.
    """
    runs = runs.assign(mesh_error=np.where(runs.index == 0, 0.03, np.nan))
    rows = [
        runs.assign(motion=motion, error_implicit=runs.error_implicit * factor)
        for motion, factor in cases.items()
    ]
    rows = pd.concat(rows, ignore_index=True).assign(
        scene="s", factor=1.0, stiffness=1.0, substeps=1, finite=True, frames=5,
        elements_sampled=3, training_residual=0.0, implicit_error=0.01,
        implicit_deformation_error=0.01, offline_s=3.0, vertices_ms=0.1,
        deformation_error=lambda rows: 2.0 * rows.error_implicit,
    ).assign(**changes)  # fmt: skip
    timed = rows[rows.ms_per_frame.notna() & rows.motion.isin(MOTIONS)]
    slower = (timed.motion != "heldout") & timed.method.str.startswith("ecsw")
    ms = timed.ms_per_frame.where(~slower, 2 * timed.ms_per_frame)
    times = pd.concat(timed.assign(process=p, ms_per_frame=p * ms) for p in (1, 2))
    times = times[[*KEYS, "process", "ms_per_frame", "vertices_ms"]]
    parts = File(str(folder / "parts.csv"), {})
    write_table(rows.drop(columns=["ms_per_frame", "vertices_ms"]), parts.path)
    return alternatives([parts], times, [*recorded]), times


def test_the_comparison_is_the_fastest_run_that_is_as_accurate(tmp_path):
    table, times = made(tmp_path)
    assert len(table) == len(CASES) * len(RUNS)
    ten = table[(table.method == "projective") & (table.iterations == 10)]
    assert ten.time_ratio.dropna().tolist() == [1.0] * 3
    found = equal_error(table, times, {"s": "springs"}, [])
    assert found.motion.tolist() == [motion for motion in MOTIONS for _ in range(2)]
    models = set(zip(found.method, found.training_motions, found.k, found.vertices, strict=True))
    assert models == {("ecsw", 1, 38, 9), ("ecsw-newton", 2, 38, 9)}
    assert found.known.tolist() == [True, False] * 2 + [False, False]
    assert found.mesh_error.tolist() == [0.03] * 6
    first, exact, slower = found.iloc[0], found.iloc[1], found.iloc[2]
    same = first[["same_method", "same_iterations", "same_error", "same_reached"]]
    assert same.tolist() == ["chebyshev", 5, 0.04, True]
    coarser = first[["coarser_method", "coarser_vertices", "coarser_error", "coarser_reached"]]
    assert coarser.tolist() == ["coarser-mesh", 4, 0.05, True]
    speedups = [*first.filter(like="speedup"), *slower.filter(like="speedup")]
    assert speedups == [12.0] * 3 + [2.0] * 3 + [6.0] * 3 + [1.0] * 3
    assert first.time_ratio == 0.0625
    # 3 s of training; .75 ms saved a frame, the median of .5 and 1
    assert first.pays_after == pytest.approx(4000.0)
    assert pd.isna(slower.pays_after)
    # no setting is as accurate: the most accurate simulation, which is no replay and no reference
    found = exact[["same_method", "same_reached", "coarser_iterations", "coarser_error"]]
    assert found.tolist() == ["projective", False, 10, 0.01]
    blown = made(tmp_path, finite=lambda rows: ~rows.method.str.startswith("ecsw"))
    assert (equal_error(*blown, {"s": "springs"}, []).position_error == np.inf).all()


def test_recorded_rows_of_other_meshes_follow_those_of_the_run(tmp_path):
    table, times = made(tmp_path)
    record, elements = tmp_path / "record.csv", {"s": "springs"}
    for again, rows in (
        (lambda: equal_error(table, times, elements, [record]),
         equal_error(table, times, elements, [])),
        (lambda: made(tmp_path, record)[0], table),
    ):  # fmt: skip
        pd.concat([rows, rows.assign(factor=2.0)]).assign(recorded="2026").to_csv(record)
        both = again()
        assert both.groupby("factor").recorded.count().to_dict() == {1.0: 0, 2.0: len(rows)}
    # the record of the times is also a table, which is not made again
    assert set(equal_error(both, times, elements, []).factor) == {1.0}
    assert equal_error(table.assign(recorded="2026"), times, {}, []).empty


def test_the_frontier_is_chosen_on_validation_trajectories(tmp_path):
    """Settings that are dominated, have no error, or were chosen on tests are omitted."""

    def finite(rows):
        return (rows.method != "ecsw") | (rows.iterations != 10)

    found = frontier.checked(frontier(*made(tmp_path, finite=finite), []))
    assert list(zip(found.part, found.simulated, found.iterations.fillna(0), strict=True)) == [
        *[("reduced", 9, 5)] * 4, ("reduced", 9, 0), ("coarser mesh", 4, 2), ("same mesh", 9, 1),
        ("same mesh", 9, 5), ("same mesh", 9, 10),
    ]  # fmt: skip
    assert found.k[:2].tolist() == [20, 38]
    assert found.validation_error[:2].tolist() == pytest.approx([0.3, 0.09])
    errors = ["validation_deformation", "position_error", "deformation_error"]
    assert found.loc[0, errors].tolist() == pytest.approx([0.6, 0.1, 0.2])
    # times are medians of the three trajectories, of which two are slower
    assert found.time_ratio[0] == 0.0625
    assert found.ahead.tolist() == pytest.approx([2.0, 8.0, 8.0, 8.0, *[np.nan] * 5], nan_ok=True)
    assert [*found.ahead_test[:2], *found.ahead_deformation[:2]] == [2.0, 8.0] * 2
    few = made(tmp_path, cases=dict.fromkeys(MOTIONS, 1.0))
    assert frontier(*few, []).empty
