"""Repeated reduced runs, the ablation, and runs with bases of rounding errors."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from builders import TOP, make_scene
from pdrom.core.store import write_hdf5
from pdrom.core.yamlfile import read_yaml
from pdrom.model.held_out import MOTIONS
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.sampling import Reduction, reductions, select
from pdrom.reduction.snapshots import SnapshotSet
from places import ROOT
from study.experiments.repetitions import noise as module
from study.experiments.repetitions.ladder import LadderSection
from study.experiments.repetitions.runs import TRAINED_ON, ReducedRuns, Repetitions, drawn
from study.figures.kit.read import rerun_infos
from study.pipeline.scenes import Coarsen, load_bound_scene

BLOCK = MethodSpec(title="elements", centring="affine", rows="element", solve="qr")
END = 9


@pytest.fixture(scope="module")
def sheet() -> tuple[Scene, np.ndarray, SnapshotSet]:
    """A hanging sheet of springs, its run of 12 frames, and the projections of the run."""
    gravity = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}
    scene = make_scene({"effect": "spring", "weight": 1e4}, gravity, TOP, frames=12)
    reference, group = trajectory(scene), scene.group("spring")
    p = np.stack([group.project(q) for q in reference[1:]])
    data = SnapshotSet(
        train=p[0::2], test=p[1::2], heldout=p[:0],
        frames={"train": np.arange(0, 12, 2), "test": np.arange(1, 12, 2)},
        row_mass=np.ones(p.shape[1]), elements=group.elements, rows_per_element=1, roundoff=1e-14,
    )  # fmt: skip
    return scene, reference, data


@pytest.fixture(scope="module")
def short(sheet) -> ReducedRuns:
    """Runs up to frame `END`."""
    scene, reference, data = sheet
    return ReducedRuns("spring", data, Yardstick(scene, reference), END).until_the_end()


def test_random_training_frames_are_stored_frames_in_order(sheet):
    data = sheet[2]
    both = np.concatenate([data.train, data.test])
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    for seed in range(5):
        found = drawn(data, seed)
        assert found.shape == data.train.shape
        places = [frames[np.flatnonzero((both == p).all(axis=(1, 2)))[0]] for p in found]
        assert (np.diff(places) > 0).all()
    assert not np.array_equal(drawn(data, 1), drawn(data, 2))


def test_the_error_covers_the_frames_before_the_end(sheet, short):
    scene, reference, data = sheet
    whole = ReducedRuns("spring", data, Yardstick(scene, reference), END)
    (reduction,) = reductions(whole.basis(BLOCK), BLOCK, [3]).values()
    (row, one), (other, _) = whole.run(reduction), short.run(reduction)
    assert (row["frames"], other["frames"]) == (12, END)
    assert row["error"] == other["error"]
    moved = np.linalg.norm(reference[1 : END + 1] - reference[0])
    expected = np.linalg.norm(one.positions[1 : END + 1] - reference[1 : END + 1]) / moved
    assert row["error"] == pytest.approx(expected, rel=1e-9)


def test_bases_of_several_training_trajectories_are_run_on_the_test_trajectories(sheet):
    scene, reference, data = sheet
    runs = ReducedRuns("spring", data, Yardstick(scene, reference), END)
    rows = list(runs.on_motions(BLOCK, [3]))
    trained = [f"held out, {count} trained" for count in TRAINED_ON]
    assert [row["varied"] for row in rows] == np.repeat(trained, len(MOTIONS)).tolist()
    other = Scene.build(scene.config.heldout_variant(MOTIONS[1]), scene.mesh)
    held = replace(runs, full=Yardstick(other, trajectory(other)))
    (reduction,) = reductions(runs.basis(BLOCK), BLOCK, [3]).values()
    assert rows[1]["error"] == held.run(reduction)[0]["error"]
    assert rows[0]["gain"] == reduction.gain != rows[-1]["gain"]


def test_a_diverged_run_has_an_infinite_error(short, monkeypatch):
    """The limit is half the extent of the sheet, so that the run ends after one frame."""
    monkeypatch.setattr("pdrom.reduction.deviations.BLOWUP_EXTENT", 0.5)
    (run,) = short.repeat(BLOCK, [3], "start", Repetitions(repetitions=1))
    assert np.isinf(run["error"])
    assert not run["finite"]


LADDER = LadderSection(**read_yaml(ROOT / "config" / "default.yaml")["ladder"])


def test_ablation_steps_change_one_ingredient_at_a_time():
    for lower, upper in zip(LADDER.up[:-1], LADDER.up[1:], strict=True):
        a, b = lower.model_dump(exclude={"title"}), upper.model_dump(exclude={"title"})
        changed = {key for key in a if a[key] != b[key]}
        assert changed
        assert len(changed - {"coefficients"}) <= 1


@pytest.mark.parametrize("p", [1, 2, 3])
def test_separate_and_shared_coefficients_are_compared_with_equal_numbers_of_entries(p, rng):
    snapshots = rng.standard_normal((12, 20 * p, 3))
    entries = []
    for direction, method, _, _ in LADDER.rungs(p):
        if direction == "square":
            basis = compute_basis(snapshots, np.ones(20 * p), 0.0, p, method)
            reduction = Reduction(basis, select(basis, method, 5), method, 5)
            entries.append(sum(len(block.entries) for block in reduction.blocks))
    assert entries == [3 * p * 5 * n for n in (1, 1, 1, 1, 3, 3)] * len(LADDER.sizes)


METHODS = load_methods(ROOT / "config" / "methods.yaml")


@pytest.fixture(scope="module")
def fall():
    return load_bound_scene(ROOT, "bend_fall", Coarsen(resolution=0.4, frames=0.4))


def test_perturbations_of_a_flat_mesh_may_stay_in_its_plane(fall):
    assert module.kinds(fall) == (module.ALL, module.PLANE, module.VERTEX)
    curved = load_bound_scene(ROOT, "bend_curved", Coarsen(resolution=0.4))
    assert module.kinds(curved) == (module.ALL,)
    every, plane, vertex = (
        module.roundoff_field(fall, axes, 1e-15, 1) for axes in module.kinds(fall)
    )
    np.testing.assert_array_equal(plane[:, :2], every[:, :2])
    np.testing.assert_array_equal(vertex[:, :2], every[:, :2])
    assert not plane[:, 2].any()
    assert np.count_nonzero(vertex[:, 2]) == 1
    assert every[:, 2].all()


def test_the_shared_row_selection_fails_if_an_axis_has_no_signal(fall, tmp_path):
    """The system of an axis is singular without noise and regular with noise."""
    asked = module.NoiseRuns(sizes=(2, 5, 99), repetitions=2)
    methods = {name: METHODS[name] for name in ("deim-joint", "published")}
    runs = tmp_path / "noise.h5"
    with write_hdf5(runs) as file:
        rows = module.noisy_runs(fall.changed(frames=22), "bending", asked, methods, file)
    table = pd.DataFrame(rows)
    beyond = table.r == 99
    assert (table.frames[beyond] == 0).all()
    singular = (table.noisy_axes == module.PLANE) & (table.method == "deim-joint") & ~beyond
    assert np.isinf(table.gain[singular]).all()
    assert (table.blowup_frame[singular] == 0).all()
    drawn = [rerun_infos(runs, f"{axes}/deim-joint") for axes in module.kinds(fall)]
    assert [[(i.r, i.marked) for i in infos] for infos in drawn] == 3 * [
        [(2, False), (5, False), (99, True)]
    ]
