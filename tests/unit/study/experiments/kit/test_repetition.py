"""Repetitions of reduced runs: what is resampled, and what stays."""

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.snapshots import SnapshotSet
from study.experiments.kit.repetition import Repeater, Repetitions, drawn

FULL = MethodSpec(title="all", centring="affine", rows="all")
BLOCK = MethodSpec(title="elements", centring="affine", rows="element", solve="qr")
END = 9


@pytest.fixture(scope="module")
def sheet() -> tuple[Scene, np.ndarray, SnapshotSet]:
    """A hanging sheet of springs, its run of 12 frames, and the projections of it."""
    scene = make_scene(
        {"effect": "spring", "weight": 1e4},
        {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]},
        {"effect": "pins", "select": "top"},
        mesh={"kind": "cloth", "rows": 6, "columns": 5},
        frames=12,
    )
    reference, group = trajectory(scene), scene.group("spring")
    p = np.stack([group.project(q) for q in reference[1:]])
    data = SnapshotSet(
        train=p[0::2], test=p[1::2], heldout=p[:0],
        frames={"train": np.arange(0, 12, 2), "test": np.arange(1, 12, 2)},
        row_mass=np.ones(p.shape[1]), elements=group.elements, rows_per_element=1, roundoff=1e-14,
    )  # fmt: skip
    return scene, reference, data


@pytest.fixture(scope="module")
def repeater(sheet) -> Repeater:
    """Two draws, judged up to frame `END`."""
    scene, reference, data = sheet
    return Repeater(scene, "spring", data, reference, END, Repetitions(repetitions=2), 100.0)


def test_drawn_frames_are_stored_ones_in_order(repeater):
    data = repeater.data
    both = np.concatenate([data.train, data.test])
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    for seed in range(5):
        found = drawn(data, seed)
        assert found.shape == data.train.shape
        places = [frames[np.flatnonzero((both == p).all(axis=(1, 2)))[0]] for p in found]
        assert (np.diff(places) > 0).all()
    assert not np.array_equal(drawn(data, 1), drawn(data, 2))


def test_a_moved_start_keeps_the_reduction_and_hardly_moves_a_tame_run(repeater):
    runs = list(repeater.repeat(BLOCK, [3], "start"))
    assert [run.seed for run in runs] == [1, 2]
    assert runs[0].gain == runs[1].gain
    assert runs[0].error != runs[1].error
    assert runs[0].error == pytest.approx(runs[1].error, rel=1e-4)


def test_other_training_frames_are_another_basis(repeater):
    one, other = repeater.repeat(BLOCK, [3], "training")
    assert one.gain != other.gain
    assert abs(one.error - other.error) > 1e-3 * one.error
    again = [run.error for run in repeater.repeat(BLOCK, [3], "training")]
    assert again == [one.error, other.error]


def test_errors_of_the_frames_make_up_the_error_before_the_horizon(sheet, repeater):
    """Theirs is in units of the motion of the whole run, that of the motion before the horizon."""
    moved = np.sum(np.square(sheet[1][1:] - sheet[1][0]), axis=(1, 2))
    run = next(repeater.repeat(BLOCK, [3], "start"))
    assert run.errors.shape == (END,)
    unit = moved.mean() / moved[:END].mean()
    assert np.sqrt(unit * np.mean(run.errors**2)) == pytest.approx(run.error, rel=1e-9)


def test_a_run_that_ends_early_is_wrong_without_bound(sheet):
    """Here one that may extend over half of the sheet only, and ends after a frame."""
    scene, reference, data = sheet
    short = Repeater(scene, "spring", data, reference, END, Repetitions(repetitions=1), 0.5)
    (run,) = short.repeat(BLOCK, [3], "start")
    assert np.isinf(run.error)
    assert np.isfinite(run.errors[0])
    assert np.isinf(run.errors[1:]).all()
    assert not run.finite


def test_sizes_beyond_the_rank_are_left_out(repeater):
    sizes = {run.r for run in repeater.repeat(FULL, [2, 999], "training")}
    assert sizes == {2}
    assert repeater.scene.config.frames == END
