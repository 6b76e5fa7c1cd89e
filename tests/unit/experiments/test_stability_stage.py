"""Rules stability and guard on a small study, made by the stages before them."""

from pathlib import Path

import pandas as pd
import pytest

from conftest import ROOT, make_scene
from pdrom.core.store import read_table
from pdrom.experiments.fom import run_fom
from pdrom.experiments.guard import try_guard
from pdrom.experiments.hyper import run_hyper
from pdrom.experiments.mesh import make_mesh
from pdrom.experiments.pod import make_basis
from pdrom.experiments.sampling import sample
from pdrom.experiments.snapshots import collect_snapshots
from pdrom.experiments.stability import sweep
from pdrom.pipeline.study import Subspace
from pdrom.reduction.method import load_methods
from pdrom.tables.columns import COLUMNS

METHODS = {
    name: spec.model_dump(mode="json")
    for name, spec in load_methods(ROOT / "config" / "methods.yaml").items()
    if name in ("pod", "deim-joint")
}
SETTINGS = {"time_steps": [0.1], "stiffness_ratios": [0.01], "ranks": [4, 30],
            "duration": 0.16, "min_frames": 8, "max_frames": 12}  # fmt: skip


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> dict:
    """Files of one scene: mesh, runs, bases, samplings, subspaces."""
    folder: Path = tmp_path_factory.mktemp("study")
    effects = [{"effect": "gravity"}, {"effect": "pins", "select": "left"}]
    effects.append({"effect": "strain", "weight": 1e6})
    scene = make_scene(
        *effects,
        mesh={"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"},
        frames=16,
        reduce={"strain": {"train": 8}},
    ).config.model_dump(mode="json")
    mesh, runs = str(folder / "mesh.h5"), {}
    make_mesh(scene["mesh"], ROOT, mesh)
    for run in ("train", "heldout"):
        runs[run] = str(folder / f"{run}.h5")
        run_fom(scene, mesh, run, "cholespy", 1, runs[run])
    snapshots = str(folder / "snapshots.h5")
    collect_snapshots(scene, "strain", mesh, runs["train"], runs["heldout"], snapshots)
    bases, samplings = [], []
    for name, spec in METHODS.items():
        identifier = f"{spec['weighting']}-{spec['centring']}-{spec['layout']}"
        bases.append(str(folder / "pod" / "strain" / f"{identifier}.h5"))
        basis = {key: spec[key] for key in ("weighting", "centring", "layout")}
        make_basis(basis, snapshots, bases[-1])
        samplings.append(str(folder / "sampling" / "strain" / f"{name}.h5"))
        labels = {"scene": "test", "group": "strain", "method": name}
        errors = str(folder / f"{name}.csv")
        sample(labels, spec, {"dense_to": 4, "step": 4}, [4], snapshots, bases[-1],
               samplings[-1], errors)  # fmt: skip
    hyper = str(folder / "models.h5")
    tables = {run: str(folder / f"models_{run}.csv") for run in runs}
    settings = Subspace(bases=("pod",), sizes=(2, 4), tolerances=(1e-2,)).model_dump(mode="json")
    run_hyper(scene, settings, 100.0, mesh, runs, hyper, tables)
    return {"scene": scene, "mesh": mesh, "fom": runs["train"], "bases": bases,
            "samplings": samplings, "hyper": hyper, "folder": folder, "tables": tables}  # fmt: skip


@pytest.fixture(scope="module")
def table(study) -> pd.DataFrame:
    output = str(study["folder"] / "stability.csv")
    sweep(study["scene"], METHODS, SETTINGS, 100.0, "cholespy", study["mesh"], study["bases"],
          study["samplings"], [study["hyper"]], output)  # fmt: skip
    return read_table(output)


def test_every_setting_holds_every_model_once(table):
    """(h, ratio): own, other h, other ratio; full order, two methods at two sizes, two models."""
    assert len(table) == 3 * (1 + 2 * 2 + 2)
    assert not table.duplicated(["h", "stiffness_ratio", "method", "position_basis", "r"]).any()
    own = {(0.016, 1.0), (0.1, 1.0), (0.016, 0.01)}
    assert set(zip(table.h, table.stiffness_ratio, strict=True)) == own
    assert table.groupby("h").frames.max().to_dict() == {0.016: 10, 0.1: 8}
    assert set(table[table.position_basis == "pod"].k) == {4}


def test_the_full_order_run_is_its_own_reference(table):
    full = table[(table.method == "full") & (table.position_basis == "full")]
    assert full.finite.all()
    assert (full.relative_error == 0.0).all()
    assert (full.energy_ratio == 1.0).all()


def test_sizes_beyond_the_rank_are_rows_without_numbers(table):
    beyond = table[table.r == 30]
    assert len(beyond) == 6
    assert (beyond.frames == 0).all()
    assert beyond[["finite", "relative_error", "energy_ratio", "gain"]].isna().all(axis=None)


def test_the_orthogonal_projection_is_accurate_at_the_own_setting(table):
    own = table[(table.h == 0.016) & (table.stiffness_ratio == 1.0) & (table.r == 4)]
    errors = own.set_index("method").relative_error
    assert errors["pod"] < 0.05
    assert own.set_index("method").gain["pod"] == 1.0
    assert own.set_index("method").gain["deim-joint"] > 1.0


def test_the_subspaces_know_their_energy(study):
    for motion in ("train", "heldout"):
        ratios = read_table(study["tables"][motion]).energy_ratio
        assert ((ratios > 0.5) & (ratios < 1.5)).all()


def test_guard_compares_its_actions_with_the_full_order(study):
    name = "deim-joint"
    case = {"scene": study["scene"], "group": "strain", "name": name, "r": 4,
            "method": METHODS[name]}  # fmt: skip
    index = list(METHODS).index(name)
    files = {"mesh": study["mesh"], "fom": study["fom"], "basis": study["bases"][index],
             "sampling": study["samplings"][index]}  # fmt: skip
    output = str(study["folder"] / "guard.csv")
    try_guard([case], {"margin": 1e-6}, 1, 100.0, "cholespy", [files], output)
    table = read_table(output)
    assert tuple(table.columns) == COLUMNS["guard"]
    full, plain, reported, fallen = (row for _, row in table.iterrows())
    assert [full.method, plain.action, reported.action, fallen.action] == [
        "full", "none", "report", "fall-back",
    ]  # fmt: skip
    assert full.relative_cost == 1.0
    assert reported.relative_error == plain.relative_error
    assert reported.fallback_frames == 0
    assert 0 < fallen.fallback_frames <= 16
    assert fallen.fallback_share == fallen.fallback_frames / 16
    assert fallen.relative_error < plain.relative_error
    assert (table.ms_per_frame > 0.0).all()


def test_guard_without_cases_is_an_empty_table(tmp_path):
    output = str(tmp_path / "guard.csv")
    try_guard([], {}, 1, 100.0, "cholespy", [], output)
    assert tuple(read_table(output).columns) == COLUMNS["guard"]
