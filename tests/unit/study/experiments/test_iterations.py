"""Experiment iterations: the sweep over K against the converged run."""

import numpy as np
import pandas as pd
import pytest

from builders import make_scene
from pdrom.core.store import read_table, write_hdf5, write_table
from pdrom.model.mesh.types import save_mesh
from pdrom.reduction.subspace.model import make_columns
from pdrom.reduction.subspace.store import store_columns, store_model
from study.artifact.paths import File
from study.experiments.iterations import COLUMNS, IterationSweep, iterations
from study.experiments.kit.settings import Horizon


def test_the_sweep_approaches_the_limit(tmp_path):
    """On a benign scene every further iteration brings the run closer to the converged one."""
    scene = make_scene(
        {"effect": "gravity"},
        {"effect": "floor"},
        {"effect": "pins", "select": "left"},
        {"effect": "spring", "weight": 1e5},
        mesh={"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"},
        frames=12,
    )
    names = ("mesh.h5", "fom.h5", "floor.csv", "out.csv", "subspaces.h5", "models.csv")
    files = (File(str(tmp_path / n), {"scene": "test"}) for n in names)
    mesh, fom, floor, output, subspaces, models = files
    save_mesh(scene.mesh, mesh.path)
    state, positions = scene.initial_state(), [scene.mesh.points]
    loop = scene.stepper()
    for frame in range(12):
        state, _ = loop.step(state, frame)
        positions.append(state.positions)
    with write_hdf5(fom.path) as file:
        file["positions"] = np.stack(positions)
    columns = make_columns(scene, np.stack(positions[1:]), "pod", 8)
    inside = np.linalg.lstsq(columns.B, np.hstack(positions))[0].reshape(-1, 13, 3)
    with write_hdf5(subspaces.path) as file:
        store_columns(file.create_group("columns/own"), columns)
        for method, frames in (("full", 13), ("ended", 5)):
            store = file.create_group(f"models/pod_k008_{method}")
            labels = {"method": method, "position_basis": "pod", "k": 8, "base": "own"}
            store_model(store, labels, {})
            store["train/coordinates"] = inside.transpose(1, 0, 2)[:frames]
    write_floor(floor.path, [1e-9] * 9 + [1.0] * 3)
    asked = IterationSweep(counts=(1, 3, 20, 60), anderson_window=4, tolerance=1e-10, limit=2000)
    horizon = Horizon(perturbation=1e-10, threshold=1e-3)

    def swept(**changes):
        sweep = asked.model_copy(update=changes)
        iterations(
            mesh=mesh, fom=fom, sensitivity=floor, config=scene.config, sweep=sweep,
            horizon=horizon, solver="splu", out=output, subspaces=[subspaces], models=models,
        )  # fmt: skip
        return read_table(output.path, COLUMNS)

    everything = swept()
    fast = everything[everything.window == 4].set_index("iterations").error_converged
    assert fast.index.tolist() == [3, 10, 20, 60]
    table = everything[everything.window != 4]
    assert (fast[[10, 20]] < 0.5 * table.set_index("iterations").error_converged[[10, 20]]).all()
    counts = table.iterations.dropna().tolist()
    assert counts == [1, 3, 10, 20, 60]
    assert (table.frames == 9).all()
    error = table.error_converged.to_numpy()
    assert (np.diff(error[:-1]) < 0.0).all()
    assert error[-2] < 0.1 * error[0]
    own = table.set_index("iterations").error_scene
    assert own[10] == 0.0
    assert own[3] < own[1]
    # the own run is as far from the limit as the limit is from it, but for the normalisation
    assert table.error_scene.iloc[-1] == pytest.approx(error[2], rel=0.2)
    assert table.residual.iloc[-1] <= 1e-10
    # positions of the own run, as its subspace holds them, are as far from the converged ones
    reduced = read_table(models.path).set_index("method").error_converged
    assert reduced["full"] == pytest.approx(error[2], rel=0.1)
    assert np.isnan(reduced["ended"])
    unfinished = swept(limit=2)
    assert unfinished.error_converged.isna().all()
    assert unfinished.error_scene.notna().all()


def write_floor(path, values) -> None:
    rows = [("test", "1e-10", 1, frame, value) for frame, value in enumerate(values)]
    rows.append(("test", "solver", 0, 0, 0.0))
    columns = ["scene", "perturbation", "seed", "frame", "relative_difference"]
    write_table(pd.DataFrame(rows, columns=columns), path)
