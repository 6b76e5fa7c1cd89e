"""Each file of one scene's experiments is compared with consequences of the files that it read.

The scene is a sheet of springs, fixed at its left side, that falls for eight frames.
"""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from bad_input.project import make_project
from pdrom import api
from pdrom.command import main
from pdrom.core.store import open_hdf5, read_table, write_table
from pdrom.core.yamlfile import read_yaml
from pdrom.model.held_out import MOTIONS
from pdrom.model.mesh.types import Mesh, stored_mesh
from places import CONFIG
from small_scene import run_jobs
from study.artifact import paths
from study.artifact.paths import File, Place
from study.experiments.iterations import iterations
from study.experiments.kit.base import Experiment
from study.experiments.references import ConvergedStepper, Reference, references
from study.experiments.repetitions.experiment import Options, repetitions
from study.experiments.repetitions.ladder import LadderSection
from study.experiments.stability import ShortRuns, stability
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.study import Study
from study.tables import declared

SCENE, GROUP, METHOD = "small", "spring", "block-deim"
ASKED = {
    "ranks": [2, "full"],
    "sensitivity": {"perturbations": [1e-10, 1e-8], "seeds": [1, 2]},
    "iterations": {"counts": [1, 2, 5, 20, 60]},
    "subspace": {"bases": ["pod"], "sizes": [2, 4], "tolerances": [1e-2]},
    "timing": {"frames": 2, "repeats": 1, "breakeven": [2], "breakeven_repeats": 5},
    "repetitions": {
        "repetitions": 3,
        "cells": [{"scenes": [SCENE], "methods": [METHOD], "sizes": [1, 2]}],
    },
}
JOBS = (
    "mesh", "fom", "sensitivity", "references", "subspaces", "iterations", "snapshots", "pod",
    "reruns", "repetitions", "timing",
)  # fmt: skip
STEP, GRAVITY, VERTEX_MASS = 0.016, 9.81, 10.0

PathOf = Callable[[Place], str]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    root = make_project(tmp_path_factory.mktemp("study"), {})
    return Study({**read_yaml(root / "config" / "default.yaml"), **ASKED}, root)


@pytest.fixture(scope="module")
def at(study: Study) -> PathOf:
    """Path of a finished file; if there are several of a kind, that of `METHOD`."""
    results = str(study.root / "results")
    run_jobs(study, results, JOBS, SCENE)
    known = {
        "scene": SCENE, "group": GROUP, "method": METHOD, "run": "train",
        "basis": study.methods[METHOD].basis_id, "mesh": study.mesh_of(SCENE),
    }  # fmt: skip
    return lambda place: place.at(results, **{name: known[name] for name in place.labels})


@pytest.fixture
def table(at: PathOf) -> Callable[[Place], pd.DataFrame]:
    return lambda place: read_table(at(place))


@pytest.fixture
def array(at: PathOf) -> Callable[[Place, str], np.ndarray]:
    def read(place: Place, name: str) -> np.ndarray:
        with open_hdf5(at(place)) as file:
            return file[name][...].astype(float)

    return read


@pytest.fixture
def again(study: Study, at: PathOf, tmp_path: Path) -> Callable[..., dict[str, pd.DataFrame]]:
    """Run an experiment again with other arguments and return its tables."""

    def made(experiment: Experiment, **changes: object) -> dict[str, pd.DataFrame]:
        labels = {"scene": SCENE, "group": GROUP}
        results = str(Path(at(paths.MACHINE)).parent)
        job = Plan(study, Folders(results)).job(experiment, labels)
        given = {name: read.content(job.inputs[name]) for name, read in experiment.files.items()}
        asked = {k: t for k, t in experiment.types.items() if k not in changes}
        given |= {k: t.validate_python(job.settings[k]) for k, t in asked.items()} | changes
        files = {name: File(str(tmp_path / f"{name}.csv"), labels) for name in job.outputs}
        experiment.function(**given, **files)
        tables = [n for n, place in experiment.writes.items() if place.pattern.endswith(".csv")]
        return {name: read_table(files[name].path) for name in tables}

    return made


@pytest.fixture
def mesh(at: PathOf) -> Mesh:
    with open_hdf5(at(paths.MESH)) as file:
        return stored_mesh(file)


def norms(values: np.ndarray) -> np.ndarray:
    """Frobenius norm of each frame."""
    return np.linalg.norm(values.reshape(len(values), -1), axis=1)


def whole(difference: np.ndarray, moved: np.ndarray) -> float:
    """Relative error of a run, in norms over all frames."""
    return float(np.linalg.norm(difference) / np.linalg.norm(moved))


def test_a_run_starts_at_rest_fixes_its_pins_and_lowers_the_objective(array, mesh):
    """Without damping, velocities are the differences of positions."""
    q, v = array(paths.TRAIN, "positions"), array(paths.TRAIN, "velocities")
    assert np.array_equal(q[0], mesh.points)
    left = mesh.points[:, 0] == mesh.points[:, 0].min()
    assert np.all(q[:, left] == mesh.points[left])
    assert v[1:] == pytest.approx(np.diff(q, axis=0) / STEP, abs=1e-9)
    objective = array(paths.TRAIN, "objective")
    assert np.all(np.diff(objective, axis=1) <= 1e-9 * np.abs(objective[:, :-1]))


def test_projection_errors_are_tails_of_the_singular_values(at, array, table):
    """The error of the sampled reconstruction is at most the DEIM constant times the best error."""
    train = array(paths.SNAPSHOTS, "train")
    sigma = array(paths.BASIS, "singular_values")
    tails = {r: np.linalg.norm(sigma[r:]) / np.linalg.norm(train) for r in (1, 2, 3)}
    sampled = table(paths.RECONSTRUCTION)
    best = read_table(at(paths.RECONSTRUCTION).replace(METHOD, "pod"))
    for found, allowed in ((best, best.gain), (sampled, sampled.gain)):
        own = found.assign(allowed=allowed)[found.split == "train"].set_index("r")
        for r, tail in tails.items():
            error, gain = own.relative_error[r], own.allowed[r]
            assert tail * (1 - 1e-9) - 1e-14 <= error <= gain * tail * (1 + 1e-9) + 1e-14
    assert (best.gain == 1.0).all()
    assert (sampled.elements_sampled < best.elements_sampled).any()


@pytest.mark.parametrize("run", ["train", "heldout"])
def test_the_table_of_reruns_has_the_differences_from_the_full_order_run(array, table, run):
    reference = array(paths.FULL_ORDER.where(run=run), "positions")
    moved = norms(reference[1:] - reference[0])
    heldout = table(paths.RERUNS_HELDOUT).query("motion == @run")
    rows = table(paths.RERUNS_TRAIN) if run == "train" else heldout
    assert rows.r.tolist() == [2, 3]
    for row in rows.itertuples():
        name = f"r{row.r:04d}" if run == "train" else f"{run}/r{row.r:04d}"
        difference = array(paths.RERUNS, f"{name}/difference")
        assert row.relative_error == pytest.approx(whole(difference, moved))
        assert (row.frames, row.finite) == (8, True)
        positions = array(paths.RERUNS, f"{name}/positions")  # in single precision
        if run != "train":  # every 20th frame of a test trajectory is stored
            np.testing.assert_array_equal(positions, reference[::20].astype(np.float32))
            continue
        assert difference == pytest.approx(norms(positions[1:] - reference[1:]), abs=1e-5)
        sides = np.ptp(positions[1:], axis=1).max(axis=1) / np.ptp(reference[0], axis=0).max()
        assert row.max_extent == pytest.approx(sides.max(), abs=1e-6)
    assert run != "train" or rows.relative_error.is_monotonic_decreasing


def test_sensitivities_grow_in_proportion_and_without_gravity_the_sheet_stays(array, table):
    """The complete displacement is then a difference between the two runs."""
    drifts = table(paths.SENSITIVITY).set_index(["perturbation", "seed", "frame"])
    drifts = drifts.relative_difference
    ratio = drifts["1e-08"] / drifts["1e-10"]
    assert ratio.to_numpy() == pytest.approx(np.full(2 * 8, 100.0), rel=1e-2)
    q = array(paths.TRAIN, "positions")
    moved = norms(q[1:] - q[0])
    expected = moved / np.sqrt(np.mean(moved**2))
    assert drifts["without gravity"].to_numpy() == pytest.approx(expected, rel=1e-9)


def test_contributions_are_forces_and_energies_of_the_run(array, table, mesh):
    q = array(paths.TRAIN, "positions")
    free = mesh.points[:, 0] > mesh.points[:, 0].min()
    rows = table(paths.CONTRIBUTIONS).set_index("effect")
    weight = VERTEX_MASS * GRAVITY
    assert rows.force["gravity"].to_numpy() == pytest.approx(weight * np.sqrt(free.sum()))
    height = weight * q[1:, :, 1].sum(axis=1)
    assert np.diff(rows.energy["gravity"]) == pytest.approx(np.diff(height), rel=1e-6)
    a, b = mesh.edges().T
    length = np.linalg.norm(q[:, a] - q[:, b], axis=2)
    springs = 0.5 * 1e5 * ((length[1:] - length[0]) ** 2).sum(axis=1)
    assert rows.energy["spring"].to_numpy() == pytest.approx(springs, rel=1e-6)


def test_more_iterations_approach_the_converged_run(table):
    rows = table(paths.ITERATIONS)
    rows = rows[rows.vertices == rows.vertices.max()]  # the mesh of the scene
    plain = rows[rows.window == 0].sort_values("iterations")
    mixed = rows[rows.window == 5].set_index("iterations").error_converged
    assert plain.iterations.tolist() == [1, 2, 5, 10, 20, 60]
    assert (np.diff(plain.error_converged) < 0.0).all()
    assert (mixed < plain.set_index("iterations").error_converged[mixed.index]).all()
    own, limit = plain[plain.iterations == 10], table(paths.REFERENCES).query("motion == 'train'")
    for name, same in (("error", "error"), ("deformation", "deformation_error")):
        assert own[f"{name}_converged"].tolist() == limit[f"full_order_{same}"].tolist()
    assert (mixed[[10, 20]] < 0.5 * plain.set_index("iterations").error_converged[[10, 20]]).all()
    assert plain.error_converged.iloc[-1] < 0.1 * plain.error_converged.iloc[0]


def shape_norms(runs: np.ndarray, reference: np.ndarray) -> list[float]:
    """SciPy's distances after the best rigid motion, of equal masses, in each frame."""
    a, b = (q - q.mean(axis=1, keepdims=True) for q in (runs, reference))
    return [Rotation.align_vectors(*frames)[1] for frames in zip(b, a, strict=True)]


def test_errors_on_test_trajectories_are_those_that_numpy_finds_in_the_stored_runs(array, at, mesh):
    made = declared()["test_trajectories"](read_table(at(paths.REFERENCES)))
    assert made.motion.tolist() == list(MOTIONS)
    training = array(paths.CONVERGED.where(run="train"), "positions")[1:]
    rest = np.repeat(mesh.points[None], 8, axis=0)
    affine = np.c_[mesh.points[:, [0, 2]], np.ones(len(mesh.points))]  # a flat mesh
    for row in made.itertuples():
        limit = array(paths.CONVERGED.where(run=row.motion), "positions")[1:]
        full = array(paths.FULL_ORDER.where(run=row.motion), "positions")[1:]
        moved, bent = norms(limit - rest), shape_norms(rest, limit)
        left = np.array([q - affine @ np.linalg.lstsq(affine, q)[0] for q in limit])
        shares = whole(bent, moved), whole(left, moved)
        assert (row.deformation, row.affine) == pytest.approx(shares, rel=1e-6)
        for run, name in ((full, "full_order"), (training, "replay")):
            found = getattr(row, f"{name}_error"), getattr(row, f"{name}_deformation_error")
            errors = whole(norms(run - limit), moved), whole(shape_norms(run, limit), bent)
            assert found == pytest.approx(errors)


def test_the_error_of_a_reference_is_set_by_its_tolerance(again, table):
    """The second solve has a hundredth of the tolerance and starts from the previous frame."""
    with patch("study.experiments.references.ConvergedStepper", wraps=ConvergedStepper) as solves:
        coarse = again(references, asked=Reference(tolerance=1e-3))["out"]
    found = [(call.args[2], call.kwargs["from_last"]) for call in solves.call_args_list]
    assert found == [(1e-3, False), (1e-5, True)] * 4
    own, fine = ["reference_error", "reference_deformation_error"], table(paths.REFERENCES)
    assert (coarse[own] > 100.0 * fine[own]).all(axis=None)
    assert (fine[own] < 1e-3).all(axis=None)


def test_the_sweep_ends_at_the_horizon_or_an_unconverged_reference(again, table, tmp_path):
    """No run is compared with an unconverged reference."""
    floor = table(paths.SENSITIVITY)
    early = File(str(tmp_path / "floor.csv"), {"scene": SCENE})
    write_table(floor.assign(relative_difference=np.where(floor.frame < 5, 1e-9, 1.0)), early.path)
    found = again(iterations, sensitivity=early)["out"]
    assert (found.frames == 5).all()
    assert found.error_converged.notna().all()
    unfinished = again(references, asked=Reference(limit=2))["out"]
    assert unfinished.filter(regex="^(full|replay|reference|deform)").isna().all(axis=None)
    none = File(str(tmp_path / "train.csv"), {"scene": SCENE})
    assert again(iterations, converged=none)["out"].error_converged.isna().all()


def test_every_time_step_and_stiffness_has_every_model_once(again, monkeypatch):
    """(h, ratio): default, other h, other ratio; full order, two methods at two sizes, 2 models."""
    monkeypatch.setattr("study.experiments.stability.FEWEST", 4)
    monkeypatch.setattr("study.experiments.stability.MOST", 6)
    asked = ShortRuns(time_steps=(0.1,), stiffness_ratios=(0.01,), ranks=(2, 30), duration=0.08)
    short_runs = again(stability, short=asked)["out"]
    keys = ["h", "stiffness_ratio", "method", "position_basis", "r"]
    assert len(short_runs) == 3 * (1 + 2 * 2 + 2)
    assert not short_runs.duplicated(keys).any()
    own = {(STEP, 1.0), (0.1, 1.0), (STEP, 0.01)}
    assert set(zip(short_runs.h, short_runs.stiffness_ratio, strict=True)) == own
    assert short_runs.groupby("h").frames.max().to_dict() == {STEP: 5, 0.1: 4}
    assert set(short_runs[short_runs.position_basis == "pod"].k) == {4}
    full = short_runs[(short_runs.method == "full") & (short_runs.position_basis == "full")]
    assert full.finite.all()
    assert (full.relative_error == 0.0).all()
    assert (full.energy_ratio == 1.0).all()
    beyond = short_runs[short_runs.r == 30]
    assert len(beyond) == 6
    assert (beyond.frames == 0).all()
    assert beyond[["finite", "relative_error", "energy_ratio", "gain"]].isna().all(axis=None)


@pytest.mark.parametrize("split", ["train", *MOTIONS])
def test_positions_of_subspace_runs_are_columns_times_coordinates(array, table, split):
    reference = array(paths.FULL_ORDER.where(run=split), "positions")
    moved = norms(reference[1:] - reference[0])
    heldout = table(paths.SUBSPACES_HELDOUT).query("motion == @split")
    rows = table(paths.SUBSPACES_TRAIN) if split == "train" else heldout
    assert rows.energy_ratio.between(0.5, 1.5, inclusive="neither").all()
    rows = rows.set_index(["k", "method"])
    for k, method in rows.index:
        columns = array(paths.SUBSPACES, f"columns/pod_k{k:03d}/B")
        z = array(paths.SUBSPACES, f"models/pod_k{k:03d}_{method}/{split}/coordinates")
        difference = norms(np.einsum("nk,fka->fna", columns, z)[1:] - reference[1:])
        assert rows.relative_error[k, method] == pytest.approx(whole(difference, moved), rel=1e-6)
    full = rows.xs("full", level="method")
    assert (np.diff(full.relative_error) < 0.0).all()
    sampled = rows.drop("full", level="method").reset_index("method").r
    assert (sampled < full.r).all()


def test_a_perturbed_start_keeps_the_error_and_other_training_frames_change_it(table):
    rows = table(paths.REPETITIONS)
    start, training = (rows[rows.varied == varied] for varied in ("start", "training"))
    assert start.groupby("r").gain.nunique().eq(1).all()
    assert start.groupby("r").error.nunique().eq(3).all()
    assert training.groupby("r").gain.nunique().eq(3).all()
    own = table(paths.RERUNS_TRAIN).set_index("r").relative_error[2]
    assert start[start.r == 2].error.to_numpy() == pytest.approx(np.full(3, own), rel=1e-4)
    assert training[training.r == 2].error.min() > 1.1 * own


def test_every_ablation_step_is_run_and_has_its_errors(study, again, array):
    """Element-wise sampling with shared coefficients is at most its constant times the best."""
    few = {"r": 2, "signs": 2, "repetitions": 3, "sizes": (2, 50), "repeated": (SCENE,)}
    asked = LadderSection(**read_yaml(CONFIG / "default.yaml")["ladder"]).model_copy(update=few)
    job = Plan(study).job(repetitions, {"scene": SCENE, "group": GROUP})
    settings = Options(**{**job.settings["settings"], "repeated": (), "own_ladder": asked})
    rows = again(repetitions, settings=settings)["rungs"]
    kinds = {"up": len(asked.up), "down": len(asked.down), "signs": 2, "square": len(asked.square)}
    assert rows.direction.value_counts(sort=False).to_dict() == kinds  # none at 50: three modes
    assert rows[rows.direction == "signs"].gain.nunique() == 2
    sigma, train = array(paths.BASIS, "singular_values"), array(paths.SNAPSHOTS, "train")
    best = np.linalg.norm(sigma[2:]) / np.linalg.norm(train)
    least = rows[rows.rung.isin(["- oversampling", asked.up[-1].title, "whole elements, shared"])]
    assert len(least) == 3
    assert least.error_train.between(0.999 * best, 1.001 * best * least.gain).all()
    repeated = rows[rows.direction.isin(["up", "down"])]
    assert (repeated.repetitions == 3).all()
    assert (repeated.error_low <= repeated.error_median).all()
    assert (repeated.error_median <= repeated.error_high).all()
    assert rows.repetitions.notna().sum() == len(repeated)


def test_every_run_is_timed_once_and_phases_fit_into_their_frame(table):
    rows = table(paths.TIMINGS)
    key = ["group", "method", "position_basis", "k", "r", "iterations", "implementation"]
    assert not rows.duplicated(key).any()
    assert set(rows.implementation) == {"compiled", "numpy", "interpreted"}
    reduced = rows[rows.group == GROUP]
    assert set(zip(reduced.method, reduced.r, strict=True)) == {
        (method, r) for method in ("pod", METHOD) for r in (2, 3)
    }
    phases = rows[["inertia_ms", "local_ms", "assembly_ms", "lift_ms", "global_ms"]]
    assert (phases >= 0.0).all(axis=None)
    assert (phases.sum(axis=1) <= rows.ms_per_frame * (1 + 1e-6)).all()
    alone = table(paths.BREAK_EVEN)
    assert len(alone) == 1
    effects = table(paths.EFFECTS)
    assert effects.effect.tolist()[:3] == ["spring", "gravity", "pins"]
    assert effects.share.sum() == pytest.approx(1.0)


def test_the_package_and_the_command_give_the_runs_of_the_study(at, array, table, tmp_path, capsys):
    config = Path(at(paths.MACHINE)).parents[1] / "config"
    full = api.run(api.load_scene(config / "scenes" / f"{SCENE}.yaml"))
    assert np.array_equal(full.positions, array(paths.TRAIN, "positions"))
    model = api.train(full, group=GROUP, method=METHOD, r=2)
    row = table(paths.RERUNS_TRAIN).set_index("r").loc[2]
    error = model.run(full.scene).error(full).position
    assert error == pytest.approx(row.relative_error, rel=1e-9)
    assert model.reduced.reduction.gain == pytest.approx(row.gain, rel=1e-9)
    scene, out = str(config / "scenes" / f"{SCENE}.yaml"), str(tmp_path / "a.model.h5")
    asked = ["--group", GROUP, "--method", METHOD, "--r", "2", "--out", out]
    assert main.run(["train", scene, *asked]) == 0
    assert f"DEIM constant {row.gain:.3g}, " in capsys.readouterr().out
    full_run, run = str(tmp_path / "full.h5"), str(tmp_path / "run.h5")
    assert main.run(["run", scene, "--out", full_run]) == 0
    assert main.run(["run", scene, "--model", out, "--compare", full_run, "--out", run]) == 0
    assert f"errors {row.relative_error:.2g} (positions)" in capsys.readouterr().out
    stored = api.load(at(paths.TRAIN))
    assert np.array_equal(stored.positions, full.positions)
    assert np.array_equal(stored.snapshots[GROUP].p[::2], full.snapshots[GROUP].p)
