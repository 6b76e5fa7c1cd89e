"""Experiment stability on a small study, made by the experiments before."""

from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pytest

from builders import make_scene
from pdrom.core.store import read_table
from pdrom.model.held_out import MOTIONS
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import load_methods
from places import ROOT
from study.artifact.paths import File
from study.experiments import fom, mesh, pod, reruns, snapshots, stability, subspaces
from study.experiments.reruns import Sweep
from study.experiments.stability import ShortRuns
from study.experiments.subspaces import SubspaceModels

METHODS = {
    name: spec
    for name, spec in load_methods(ROOT / "config" / "methods.yaml").items()
    if name in ("pod", "deim-joint")
}
SHORT = ShortRuns(
    time_steps=(0.1,), stiffness_ratios=(0.01,), ranks=(4, 30), duration=0.16, min_frames=8,
    max_frames=12,
)  # fmt: skip
LIMITS = {"blowup_extent": 100.0, "solver": "supernodal"}


@dataclass(frozen=True)
class Made:
    """Files of one scene."""

    scene: SceneConfig
    folder: Path
    mesh: File
    runs: dict[str, File]
    bases: list[File]
    samplings: list[File]
    subspaces: File
    tables: dict[str, File]


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Made:
    folder: Path = tmp_path_factory.mktemp("study")

    def file(name: str, **labels: str) -> File:
        return File(str(folder / name), {"scene": "test", **labels})

    effects = [{"effect": "gravity"}, {"effect": "pins", "select": "left"}]
    effects.append({"effect": "strain", "weight": 1e6})
    scene = make_scene(
        *effects,
        mesh={"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"},
        frames=16,
        reduce={"strain": {"train": 8}},
    ).config
    grid = file("mesh.h5")
    mesh.mesh(sources=[], config=scene.mesh, out=grid)
    runs = {run: file(f"{run}.h5", run=run) for run in ("train", *MOTIONS)}
    fom.fom(mesh=grid, config=scene, solver="supernodal", **runs)
    stored = file("snapshots.h5", group="strain")
    two = {run: runs[run] for run in ("train", "heldout")}
    snapshots.snapshots(mesh=grid, **two, config=scene, out=stored)
    bases, samplings = [], []
    for name, spec in METHODS.items():
        bases.append(file(f"pod/{name}.h5", group="strain", basis=spec.basis_id))
        pod.pod(snapshots=stored, spec=spec, out=bases[-1])
        labels = {"group": "strain", "method": name}
        names = ("sampling", "errors", "runs", "out", "heldout_table")
        outputs = {kind: file(f"{name}/{kind}", **labels) for kind in names}
        settings = reruns.Options(
            scene=scene, method=spec, sweep=Sweep(dense_to=4, step=4), ranks=(4,),
            heldout_ranks=(), **LIMITS,
        )  # fmt: skip
        reruns.reruns(
            mesh=grid, fom=runs["train"], motions=list(runs.values()), snapshots=stored,
            basis=bases[-1], settings=settings, **outputs,
        )  # fmt: skip
        samplings.append(outputs["sampling"])
    models = file("models.h5")
    tables = {run: file(f"models_{run}.csv") for run in runs}
    asked = SubspaceModels(
        bases=("pod",), sizes=(2, 4), tolerances=(1e-2,),
    )  # fmt: skip
    subspaces.subspaces(
        mesh=grid,
        full_order=list(runs.values()),
        settings=subspaces.Options(scene=scene, subspace=asked, blowup_extent=100.0),
        out=models,
        train_table=tables["train"],
        heldout_table=tables["heldout"],
        seconds_table=file("seconds.csv"),
    )
    return Made(scene, folder, grid, runs, bases, samplings, models, tables)


@pytest.fixture(scope="module")
def table(study) -> pd.DataFrame:
    output = File(str(study.folder / "stability.csv"), {"scene": "test"})
    stability.stability(
        mesh=study.mesh, bases=study.bases, samplings=study.samplings, subspaces=[study.subspaces],
        config=study.scene, methods=METHODS, short=SHORT, **LIMITS, out=output,
    )  # fmt: skip
    return read_table(output.path)


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
        ratios = read_table(study.tables[motion].path).energy_ratio
        assert ((ratios > 0.5) & (ratios < 1.5)).all()
