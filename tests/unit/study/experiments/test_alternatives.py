"""Experiment `alternatives`: errors against both references, and tables of its rows."""

import pandas as pd
import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom.core.store import read_table
from pdrom.core.yamlfile import validate
from pdrom.model.held_out import MOTIONS
from places import ROOT
from study.artifact.paths import File
from study.artifact.reads import RECORD
from study.experiments.alternatives import experiment
from study.experiments.alternatives.experiment import Alternatives, Comparison
from study.tables import declared
from study.tables.alternatives import alternatives
from study.tables.kit.results import DAY, with_recorded

EFFECTS = (GRAVITY, LEFT, {"effect": "spring", "weight": 1e4})
STEPS = {
    "projective": ((1, 5), (1, 10), (1, 2000), (8, 1)),
    "anderson": ((1, 200),),
    "chebyshev": ((1, 10),),
    "chebyshev-power": ((1, 10),),
    "two-level": ((1, 20),),
    "coarser-mesh": ((1, 10), (1, 2000)),
    "coarser-mesh-anderson": ((1, 10),),
}
MODELS = ({"modes": 4, "training_motions": (1, 3)}, {"modes": 3, "training_motions": (3,)})
COARSER, SETTINGS = {20, 16}, 8 + 3 * 2 + 3 * 2  # full-order model, coarser meshes, reduced models


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    mesh = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
    scene = make_scene(*EFFECTS, mesh=mesh, frames=80, held_out={"kick": 0.5})
    folder = tmp_path_factory.mktemp("alternatives")
    asked = {
        "steps": STEPS, "choice": {"test/1": MODELS}, "validation": 1, "coarser": (0.8, 0.5),
        "seconds": 0.128, "frames": 2, "repeats": 1, "processes": 2,
    }  # fmt: skip
    section = validate(Alternatives, asked, "here")
    names = {"out": "x1.csv", "times": "x1_times.csv"}
    files = {key: File(str(folder / name), {"factor": "1"}) for key, name in names.items()}
    experiment.alternatives(sources=[], config=scene.config, section=section, **files)
    return files["out"], files["times"]


@pytest.fixture(scope="module")
def table(written):
    parts, times = written
    return alternatives([parts], read_table(times.path), [])


def test_a_scene_has_a_row_for_every_setting_mesh_and_trajectory(written, table):
    made = read_table(written[0].path)
    assert made.columns.tolist() == experiment.COLUMNS
    raw = read_table(written[1].path)
    assert raw.columns.tolist() == experiment.TIME_COLUMNS
    assert len(table) == len(made)
    # plus a row of the converged step for each mesh, and one of replaying the training trajectory
    motions = [*MOTIONS, "validation_1"]
    assert table.motion.value_counts().to_dict() == dict.fromkeys(motions, SETTINGS + 4)
    assert {*table.vertices[table.method.str.startswith("coarser-mesh")]} == COARSER
    assert {*table.vertices[table.method == "converged"]} == COARSER | {30}
    reduced = table[table.method.isin(experiment.REDUCTIONS)]
    assert reduced.groupby(["k", "training_motions"]).size().to_dict() == {
        (3, 3): 8, (4, 1): 8, (4, 3): 8,
    }  # fmt: skip
    assert reduced.iterations.isna().tolist() == (reduced.method == "ecsw-newton").tolist()
    assert reduced.offline_s.nunique() == 3
    timed = table[~table.method.isin(["converged", "playback"]) & table.motion.isin(MOTIONS)]
    assert (timed.ms_per_frame > 0.0).all()
    assert (timed.processes == 2).all()
    assert {*raw.motion} == {*MOTIONS}
    plain, other = (
        raw[(raw.method == method) & (raw.iterations == count) & (raw.substeps == 1)]
        .set_index(["motion", "process"]).ms_per_frame
        for method, count in (("projective", 10), ("anderson", 200))
    )  # fmt: skip
    ratio = (other / plain).groupby("motion").median()
    found = timed[timed.method == "anderson"].set_index("motion").time_ratio
    same = {"check_names": False, "check_index_type": False}
    pd.testing.assert_series_equal(found.sort_index(), ratio.sort_index(), **same)


def test_errors_of_a_scene_are_relative_to_the_converged_step(table):
    table = table[(table.motion == "heldout") & (table.training_motions.fillna(1) == 1)]
    case = table.set_index(["method", "substeps", "iterations"]).sort_index()
    assert (case.frames == 8).all()
    # many iterations end at the implicit step
    assert case.error_implicit["anderson", 1, 200].item() < 1e-4
    assert case.error_implicit["projective", 1, 2000].item() < 1e-4
    own = table[table.method == "converged"].set_index("vertices")
    assert (table.implicit_deformation_error > table.implicit_error).all()
    shapes = [case.deformation_error["projective", 1, n].item() for n in (5, 10, 2000)]
    assert shapes[0] > shapes[1] > 1e-3 > shapes[2]
    assert own.error_implicit[30] == 0.0
    assert case.elements_sampled["ecsw", 1, 5].item() > 0
    assert case.error_implicit["playback", 1].item() > 0.3
    # many iterations on a coarser mesh end at the converged step of that mesh
    coarse = case.loc[("coarser-mesh", 1, 2000)].set_index("vertices").error_implicit
    pd.testing.assert_series_equal(coarse, own.error_implicit[coarse.index], rtol=1e-3)
    assert own.error_implicit[16] > own.error_implicit[20] > 1e-3


def test_a_finer_mesh_has_the_mass_of_the_scene():
    config = make_scene(*EFFECTS, mesh={"kind": "cloth", "rows": 6, "columns": 5}).config
    finer = experiment.sized(config, 2.0)
    vertices = finer.mesh.build(experiment.Path()).vertices
    assert finer.vertex_mass * vertices == pytest.approx(30 * config.vertex_mass)


@pytest.mark.parametrize("name", [n for n, t in declared().items() if DAY in t.columns])
def test_recorded_rows_of_another_machine_have_no_times(name, tmp_path):
    columns = declared()[name].columns
    times = [c.name for c in columns if c.timed and c.unit in ("ms", "s")]
    assert not {*times} & {*pd.read_csv(ROOT / RECORD.format(name))}
    other = pd.DataFrame({c.name: ["1"] for c in columns})
    other.to_csv(tmp_path / "record.csv", index=False)
    for rows in (pd.DataFrame(), other.assign(scene="0")):
        made = with_recorded(rows, [tmp_path / "record.csv"], columns).iloc[-1]
        assert {*made[made.isna()].index} == {*times}


def test_settings_that_cost_too_much_are_left_out():
    work = {"anderson": 2000, "converged": 100}
    asked = Comparison(work=work, steps=STEPS)
    assert asked.pairs("anderson", 10) == [(1, 200)]
    assert asked.pairs("anderson", 11) == []
    assert asked.pairs("coarser-mesh", 10**6) == [(1, 10), (1, 2000)]
    assert [asked.affords("converged", cost) for cost in (100, 101)] == [True, False]
