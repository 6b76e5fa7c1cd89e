"""Repetitions of reduced runs: what is resampled, and what stays."""

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import reductions
from pdrom.reduction.snapshots import SnapshotSet
from study.experiments.repetitions import ReducedRuns, Repetitions, drawn

FULL = MethodSpec(title="all", centring="affine", rows="all")
BLOCK = MethodSpec(title="elements", centring="affine", rows="element", solve="qr")
END = 9
TWICE = Repetitions(repetitions=2)


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
def short(sheet) -> ReducedRuns:
    """Runs up to frame `END`."""
    scene, reference, data = sheet
    return ReducedRuns(scene, "spring", data, reference, END, 100.0).until_the_end()


def test_drawn_frames_are_stored_ones_in_order(sheet):
    data = sheet[2]
    both = np.concatenate([data.train, data.test])
    frames = np.concatenate([data.frames["train"], data.frames["test"]])
    for seed in range(5):
        found = drawn(data, seed)
        assert found.shape == data.train.shape
        places = [frames[np.flatnonzero((both == p).all(axis=(1, 2)))[0]] for p in found]
        assert (np.diff(places) > 0).all()
    assert not np.array_equal(drawn(data, 1), drawn(data, 2))


def test_a_moved_start_keeps_the_reduction_and_hardly_moves_a_tame_run(short):
    runs = list(short.repeat(BLOCK, [3], "start", TWICE))
    assert [run.seed for run in runs] == [1, 2]
    assert runs[0].gain == runs[1].gain
    assert runs[0].error != runs[1].error
    assert runs[0].error == pytest.approx(runs[1].error, rel=1e-4)


def test_other_training_frames_are_another_basis(short):
    one, other = short.repeat(BLOCK, [3], "training", TWICE)
    assert one.gain != other.gain
    assert abs(one.error - other.error) > 1e-3 * one.error
    again = [run.error for run in short.repeat(BLOCK, [3], "training", TWICE)]
    assert again == [one.error, other.error]


def test_the_error_is_that_of_the_frames_before_the_end(sheet, short):
    scene, reference, data = sheet
    whole = ReducedRuns(scene, "spring", data, reference, END, 100.0)
    (reduction,) = reductions(whole.basis(BLOCK), BLOCK, [3]).values()
    one, other = whole.run(reduction), short.run(reduction)
    assert (one.frames, other.frames) == (12, END)
    assert whole.error(one) == short.error(other)
    moved = np.linalg.norm(reference[1 : END + 1] - reference[0])
    expected = np.linalg.norm(one.positions[1 : END + 1] - reference[1 : END + 1]) / moved
    assert whole.error(one) == pytest.approx(expected, rel=1e-9)


def test_signs_are_drawn_by_a_seed(short):
    """They change a basis whose modes the mean is added to, and no other."""
    published = MethodSpec(
        title="p", centring="mean-in-modes", rows="joint", solve="tikhonov", repeat_rows=True
    )
    one, two = (short.basis(published, signs=seed).V for seed in (1, 2))
    assert not np.array_equal(one, two)
    assert short.basis(published, signs=1).V is one
    np.testing.assert_array_equal(short.basis(BLOCK, signs=1).V, short.basis(BLOCK).V)


def test_a_run_that_ends_early_is_wrong_without_bound(sheet):
    """Here one that may extend over half of the sheet only, and ends after a frame."""
    scene, reference, data = sheet
    narrow = ReducedRuns(scene, "spring", data, reference, END, 0.5).until_the_end()
    (run,) = narrow.repeat(BLOCK, [3], "start", Repetitions(repetitions=1))
    assert np.isinf(run.error)
    assert not run.finite


def test_sizes_beyond_the_rank_are_left_out(short):
    sizes = {run.r for run in short.repeat(FULL, [2, 999], "training", TWICE)}
    assert sizes == {2}
    assert short.scene.config.frames == END
