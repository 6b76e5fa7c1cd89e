"""Training and test frames, row masses, and files of snapshots."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import GRAVITY, TOP, make_scene
from pdrom.core.errors import SnapshotError
from pdrom.core.store import open_hdf5, write_hdf5
from pdrom.model.runs import run
from pdrom.reduction import snapshots

FRAMES = st.integers(4, 500)
TRAIN = snapshots.training_frames(12, 3)


@given(frames=FRAMES, data=st.data())
def test_training_and_test_frames_are_disjoint_and_spread(frames, data):
    count = data.draw(st.integers(2, (frames + 1) // 2))
    train, test = snapshots.training_frames(frames, count), snapshots.test_frames(frames)
    assert len(train) == len(np.unique(train)) == count
    assert not np.intersect1d(train, test).size
    assert train[0] == 0
    assert train[-1] == 2 * ((frames - 1) // 2)
    assert set(train % 2) == {0}
    np.testing.assert_array_equal(test, [f for f in range(frames) if f % 2])
    gaps = np.diff(train)
    assert gaps.max() - gaps.min() <= 2
    stored = snapshots.stored_frames(frames, count)
    np.testing.assert_array_equal(stored, sorted({*train.tolist(), *test.tolist()}))


def test_the_mass_of_a_vertex_is_divided_equally_among_its_elements(group_scene, rng):
    """All rows of an element have its mass; the mass of a vertex with elements is used up."""
    group = group_scene.groups[0]
    masses = rng.uniform(0.5, 2.0, group_scene.mesh.vertices)
    rows = snapshots.row_masses(group, masses).reshape(group.elements, group.rows_per_element)
    ends = (group.S.toarray().reshape(*rows.shape, -1) != 0.0).any(axis=1)
    valence = ends.sum(axis=0)
    expected = [sum(masses[v] / valence[v] for v in np.flatnonzero(own)) for own in ends]
    np.testing.assert_allclose(rows, np.tile(expected, (rows.shape[1], 1)).T, rtol=1e-13)
    assert rows[:, 0].sum() == pytest.approx(masses[valence > 0].sum(), rel=1e-12)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Scene with a training and a test run of 12 frames."""
    folder = tmp_path_factory.mktemp("runs")
    scene = make_scene(GRAVITY, TOP, {"effect": "spring", "weight": 1e4}, frames=12)
    run(scene, folder / "train.h5", {"spring": snapshots.stored_frames(12, 3)})
    run(scene, folder / "held.h5", {"spring": np.array([1, 6])})
    return scene, folder


def collected(runs, frames=TRAIN, **paths):
    """Snapshots of the runs, or of other files instead of theirs."""
    scene, folder = runs
    files = {name: folder / f"{name}.h5" for name in ("train", "held")} | paths
    return snapshots.collect(files["train"], files["held"], scene.groups[0], scene.masses, frames)


def test_training_and_test_snapshots_contain_their_frames(runs):
    scene, folder = runs
    group, got = scene.groups[0], collected(runs)
    np.testing.assert_array_equal(got.frames["train"], TRAIN)
    np.testing.assert_array_equal(got.frames["test"], snapshots.test_frames(12))
    np.testing.assert_array_equal(got.frames["heldout"], [1, 6])
    with open_hdf5(folder / "train.h5") as file:
        store = file["snapshots/spring"]
        frames, p, roundoff = (store[name][...] for name in ("frames", "p", "roundoff"))
    for split in ("train", "test"):
        at = np.searchsorted(frames, got.frames[split])
        np.testing.assert_array_equal(getattr(got, split), p[at])
    at = np.searchsorted(frames, TRAIN)
    assert got.roundoff == pytest.approx(np.sqrt((roundoff[at] ** 2).sum()))
    # small, but not zero
    assert 0.0 < got.roundoff < 1e-11 * np.linalg.norm(scene.mesh.points)
    assert got.train.shape == (3, group.elements, 3)
    assert (got.elements, got.rows_per_element) == (group.elements, 1)


def test_snapshots_are_read_as_they_were_written(runs, tmp_path):
    got = collected(runs)
    snapshots.save_snapshots(got, tmp_path / "s.h5")
    np.testing.assert_equal(vars(snapshots.load_snapshots(tmp_path / "s.h5")), vars(got))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda p: np.where(np.arange(p.size).reshape(p.shape) == 4, np.nan, p),
        lambda p: np.full_like(p, np.inf),
        lambda p: p[:0],
    ],
)
@pytest.mark.parametrize("which", ["train", "held"])
def test_faulty_snapshots_name_file_and_group(runs, tmp_path, spoil, which):
    spoilt = tmp_path / "spoilt.h5"
    with open_hdf5(runs[1] / f"{which}.h5") as file:
        store = {name: data[...] for name, data in file["snapshots/spring"].items()}
    store["p"] = spoil(store["p"])
    with write_hdf5(spoilt) as file:
        for name, data in store.items():
            file[f"snapshots/spring/{name}"] = data[: len(store["p"])]
    with pytest.raises(SnapshotError, match=r"spoilt\.h5: .*'spring'"):
        collected(runs, np.array([0]), **{which: spoilt})


def test_missing_training_frames_are_named(runs):
    for train in (np.array([], dtype=int), np.array([0, 2])):
        with pytest.raises(SnapshotError, match=r"train\.h5: snapshots of 'spring'.* train frames"):
            collected(runs, train)
