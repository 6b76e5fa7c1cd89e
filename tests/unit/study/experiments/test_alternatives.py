"""Experiment alternatives: errors against both references, and the tables of its rows."""

import numpy as np
import pandas as pd
import pytest

from builders import GRAVITY, LEFT, frame, make_scene
from pdrom.core.errors import ConfigurationError
from pdrom.core.store import read_table, write_table
from pdrom.core.yamlfile import validate
from pdrom.model.held_out import MOTIONS
from places import ROOT
from study.artifact.paths import File
from study.artifact.reads import RECORD
from study.experiments.alternatives import experiment
from study.experiments.alternatives.experiment import Alternatives, Comparison
from study.tables import declared
from study.tables.alternatives import _pays, alternatives, winners
from study.tables.kit.results import with_recorded

EFFECTS = (GRAVITY, LEFT, {"effect": "spring", "weight": 1e4})
STEPS = {
    "projective": ((1, 5), (1, 10), (1, 2000), (8, 1)),
    "anderson": ((1, 200),),
    "explicit": ((1, 1), (64, 1)),
    "two-level": ((1, 20),),
    "ecsw": ((1, 10), (4, 2)),
    "ecsw-anderson": ((1, 10),),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    mesh = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
    scene = make_scene(*EFFECTS, mesh=mesh, frames=8, held_out={"kick": 0.5})
    folder = tmp_path_factory.mktemp("alternatives")
    asked = Comparison(
        stiffness={"test": (1.0, 4.0)}, steps=STEPS, modes=(4,), training_motions=(1, 3), frames=2,
        repeats=1, processes=2,
    )  # fmt: skip
    names = {"out": "x1.csv", "times": "x1_times.csv"}
    files = {key: File(str(folder / name), {"factor": "1"}) for key, name in names.items()}
    experiment.alternatives(sources=[], config=scene.config, section=asked, **files)
    return files["out"], files["times"]


@pytest.fixture(scope="module")
def table(written):
    parts, times = written
    return alternatives([parts], [times], [])


def test_rows_of_a_scene(written, table):
    made = read_table(written[0].path)
    assert made.columns.tolist() == experiment.COLUMNS
    assert read_table(written[1].path).columns.tolist() == experiment.TIME_COLUMNS
    assert len(table) == len(made)
    # reductions are trained twice; the reference and playback have one row each
    all_of = sum(map(len, STEPS.values()))
    assert table.motion.value_counts().to_dict() == dict.fromkeys(MOTIONS, 2 * (2 + all_of + 3))
    reduced = table[table.training_motions.notna()]
    assert reduced.groupby("training_motions").size().to_dict() == {1: 24, 3: 18}
    assert (reduced.groupby(["stiffness", "substeps"]).offline_s.nunique() >= 2).all()
    inside = reduced[reduced.method.str.startswith("ecsw")]
    assert (inside.span_error > 0.0).all()
    assert (inside.groupby(["training_motions", "motion"]).span_error.nunique() == 2).all()
    timed = table[~table.method.isin(["converged", "playback"])].set_index("method")
    assert (timed.ms_per_frame > 0.0).all()
    assert (timed.processes == 2).all()
    stiffer = table[table.motion == "stiffness"].set_index(["method", "iterations"])
    own = table[table.motion == "heldout"].set_index(["method", "iterations"])
    # motions have the same times and different errors
    stiff, soft = (rows.loc[("projective", 5)] for rows in (stiffer, own))
    assert stiff.ms_per_frame.tolist() == soft.ms_per_frame.tolist()
    assert (stiff.error_implicit != soft.error_implicit).all()
    raw = read_table(written[1].path).query("stiffness == 4.0").set_index("process")
    plain = raw.query("method == 'projective' and iterations == 10").ms_per_frame
    ratio = (raw[raw.iterations == 200].ms_per_frame / plain).median()
    assert (table[(table.stiffness == 4.0) & (table.iterations == 200)].time_ratio == ratio).all()


def test_errors_of_a_scene(table):
    table = table[(table.motion == "heldout") & (table.training_motions.fillna(1) == 1)]
    case = table[table.stiffness == 1.0].set_index(["method", "substeps", "iterations"])
    # many iterations end at the implicit step, many explicit steps in continuous time
    assert case.error_implicit["anderson", 1, 200] < 1e-4
    assert case.error_implicit["projective", 1, 2000] < 1e-4
    assert case.error_continuous["explicit", 64, 1] < 1e-3
    own = table[(table.method == "converged") & (table.stiffness == 1.0)].iloc[0]
    assert (table.implicit_deformation_error > table.implicit_error).all()
    shapes = [case.deformation_error["projective", 1, count] for count in (5, 10, 2000)]
    assert shapes[0] > shapes[1] > 1e-3 > shapes[2]
    assert own.error_continuous > 1e-3 > own.error_implicit == 0.0
    own_error = pytest.approx(own.error_continuous, rel=1e-2)
    assert case.error_continuous["anderson", 1, 200] == own_error
    assert case.elements_sampled["ecsw", 1, 10] > 0
    assert case.sort_index().error_implicit["playback", 1].iloc[0] > 0.3


def test_a_finer_mesh_has_the_mass_of_the_scene():
    config = make_scene(*EFFECTS, mesh={"kind": "cloth", "rows": 6, "columns": 5}).config
    finer = experiment.sized(config, 2.0, 10.0)
    vertices = finer.mesh.build(experiment.Path()).vertices
    assert finer.vertex_mass * vertices == pytest.approx(30 * config.vertex_mass)
    assert [getattr(effect, "weight", None) for effect in finer.effects] == [None, None, 1e5]


def test_tables_of_the_rows(written, table):
    times = [written[1]]
    found = winners(table, times, [1.0, 1e-3, 1e-12], [])
    counts = found.groupby(["reference", "measure"]).size()
    assert counts["implicit", "position"] >= counts["implicit", "both"] >= 2 * 3
    assert counts["continuous", "position"] == 2 * 3 * 2
    assert len(winners(alternatives([], [], []), [], [0.1], [])) == 0
    strict = found[(found.limit == 1e-3) & (found.reference == "continuous")]
    assert (strict[strict.motion == "heldout"].method == "explicit").all()
    assert (found.motions == 3).all()
    assert 1e-12 not in set(found.limit)
    assert not found.method.isin(experiment.REDUCTIONS).any()


def test_recorded_rows_of_other_meshes_are_beside_those_of_the_run(written, table, tmp_path):
    parts, times = written
    record = tmp_path / "record.csv"
    finer = table.assign(recorded="2026-01-02", vertices=120)
    pd.concat([table.assign(recorded="2026-01-02"), finer]).to_csv(record, index=False)
    both = alternatives([parts], [times], [record])
    assert both.groupby("vertices").recorded.count().to_dict() == {30: 0, 120: len(table)}
    # what is recorded of the times is a table as well, which is not made again
    assert set(winners(both, [times], [0.1], []).vertices) == {30}


def test_winners_are_the_cheapest_that_reach_the_error(tmp_path):
    labels = {"scene": "s", "factor": 1.0, "stiffness": 1.0, "substeps": 1, "iterations": 1}
    labels["k"] = np.nan
    rows = frame(
        "method ms_per_frame error_implicit deformation_error", ("a", 1.0, 0.05, 0.05),
        ("b", 2.0, 0.005, 0.02), ("ecsw", 0.5, 0.02, 0.2), ("c", 0.1, np.nan, np.nan),
        ("converged", np.nan, 0.0, 0.0),
    ).assign(
        **labels, training_motions=lambda t: t.method.map({"ecsw": 4}), offline_s=3.0, vertices=9,
        vertices_ms=0.1, motion="heldout", error_continuous=lambda t: t.error_implicit,
        reference_error=1e-2, recorded=None, time_ratio=2.0, vertices_ratio=0.2,
        implicit_error=3e-3, implicit_deformation_error=1e-2,
    )  # fmt: skip
    # speed-ups are ratios within a process; in the second one both methods are slower
    ms = rows.dropna(subset="ms_per_frame").drop(columns="error_implicit")
    slow = ms.assign(process=2, ms_per_frame=4.0 * ms.ms_per_frame)
    measured = pd.concat([ms.assign(process=1), slow])[experiment.TIME_COLUMNS]
    write_table(measured, tmp_path / "times.csv")
    files = [File(str(tmp_path / "times.csv"), {})]
    found = winners(rows, files, [0.1, 0.01], []).set_index(["reference", "measure", "limit"])
    loose, strict = (found.loc["implicit", "position", limit] for limit in (0.1, 0.01))
    assert [loose.method, *loose.filter(like="reduced_speedup")] == ["a", 2.0, 2.0, 2.0]
    assert (loose.reduced_training_motions, loose.reduced_pays_after) == (4, 6000.0)
    assert (strict.method, strict.reduced_error) == ("b", 0.02)
    # no verdict where a third of the limit is below an error of the reference itself
    assert found.reduced_time_ratio.notna().tolist() == [False, True, True, False]
    # the reduction misses the shapes; in a rigid motion positions decide
    shown = found[["method", "error", "reduced_error"]].loc["implicit", "both", 0.1]
    assert shown.tolist() == ["a", 0.05, 0.2]
    rigid = rows.assign(deformation_error=np.nan, implicit_deformation_error=np.nan)
    assert winners(rigid, files, [0.1], []).reduced_time_ratio.tolist() == [2.0, 2.0, 2.0]
    found = winners(rigid.assign(implicit_error=np.nan), files, [0.1], [])
    assert found.reference.tolist() == ["continuous"]


@pytest.mark.parametrize("name", [n for n, t in declared().items() if "recorded" in t.column_names])
def test_a_table_has_no_times_of_two_machines(name, tmp_path):
    columns = declared()[name].columns
    times = [c.name for c in columns if c.timed and c.unit in ("ms", "s")]
    assert not {*times} & {*pd.read_csv(ROOT / RECORD.format(name))}
    other = pd.DataFrame({c.name: ["1"] for c in columns})
    other.to_csv(tmp_path / "record.csv", index=False)
    for rows in (pd.DataFrame(), other.assign(scene="0")):
        made = with_recorded(rows, [tmp_path / "record.csv"], columns).iloc[-1]
        assert {*made[made.isna()].index} == {*times}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": {"andersn": [[1, 1]]}}, "andersn.*anderson"),
        ({"steps": {"anderson": [[0, 1]]}}, "anderson"),
        ({"stiffness": {"s": [0.0]}}, "stiffness"),
    ],
)
def test_faulty_settings_are_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        validate(Alternatives, changes, "here")


def test_steps_that_cost_too_much_are_left_out_and_weights_vary_on_the_own_mesh_only():
    asked = Comparison(
        work={"anderson": 2000, "converged": 100, "training": 40}, steps=STEPS,
        stiffness={"s": (1.0, 100.0)},
    )  # fmt: skip
    assert asked.pairs("anderson", 10) == [(1, 200)]
    assert asked.pairs("anderson", 11) == asked.pairs("chebyshev", 1) == []
    assert asked.pairs("explicit", 10**6) == [(1, 1), (64, 1)]
    assert [asked.affords("converged", cost) for cost in (100, 101)] == [True, False]
    assert [n for n in asked.training_motions if asked.affords("training", 10 * n)] == [1, 2, 4]
    assert asked.factors("s", 1.0) == (1.0, 100.0)
    assert asked.factors("s", 2.0) == asked.factors("other", 1.0) == (1.0,)


def test_the_size_from_which_a_reduction_pays():
    rows = frame(
        "vertices plain_speedup reduced_speedup reduced_speedup_low reduced_speedup_high",
        (100, 2.0, 0.25, 0.2, 0.3), (400, 8.0, 0.5, 0.4, 0.6), (10_000, 200.0, 50.0, 40.0, 60.0),
    )  # fmt: skip

    def pays(own: pd.DataFrame, *others: pd.DataFrame) -> dict[str, object]:
        slower = own.assign(reduced_speedup=0.9 * own.reduced_speedup)
        slower.reduced_speedup_low *= 0.1
        return _pays(pd.concat([own, slower, *others]))

    usual = pays(rows)
    assert (usual["from_plain"], usual["from_best"]) == (100, 10_000)
    assert (usual["speedup"], usual["speedup_low"], usual["speedup_high"]) == (47.5, 4.0, 60.0)
    assert (usual["motions"], usual["reached"]) == (2, 2)
    strict = pays(rows.assign(reduced_speedup=[0.5, np.nan, 3.0], plain_speedup=np.nan))
    assert (strict["from_plain"], strict["from_best"]) == (None, 10_000)
    never = pays(rows.assign(reduced_speedup=[3.0, 2.0, np.nan]))
    assert (never["from_best"], never["reached"]) == (None, 0)
    always = rows.assign(reduced_speedup=[2.0, 2.0, 2.0])
    assert pays(always)["from_best"] == 100
    # a reduction that misses the error in one motion does not pay
    assert pays(always, always.assign(reduced_speedup=np.nan))["from_best"] is None
