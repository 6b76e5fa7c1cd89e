"""What runs are saved, read, drawn and shown as: nothing is lost, and faults are named."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from pdrom import api
from pdrom.api.pictures import viewed_scenes
from pdrom.core.errors import ConfigurationError, PdromError, SceneError, StorageError
from pdrom.core.store import write_hdf5

EFFECTS = [
    {"effect": "gravity"},
    {"effect": "pins", "select": "left"},
    {"effect": "spring", "weight": 1e5},
    {"effect": "strain", "weight": 1e5},
]
MESH = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}


def scene(frames: int = 8, **keys):
    """A small sheet of two groups."""
    return api.build_scene(mesh=MESH, frames=frames, effects=EFFECTS, **keys)


@pytest.fixture(scope="module")
def full() -> api.FullRun:
    return api.run(scene())


@pytest.fixture(scope="module")
def reduced(full: api.FullRun) -> api.ReducedRun:
    return api.reduce(full, "spring", "block-deim", 2)


@pytest.mark.parametrize("method", list(api.methods()))
def test_every_method_runs_to_its_end_or_says_where_it_blew_up(full, method):
    made = api.reduce(full, "spring", method, 2)
    outcome = made.outcome
    assert np.isfinite(outcome.positions).all()
    assert len(made.error) == outcome.frames
    assert outcome.finite == (outcome.blowup_frame is None)
    assert outcome.frames == 8 or not outcome.finite
    assert made.gain >= 1.0 - 1e-9
    assert made.ms > 0.0


def test_a_picture_has_a_line_for_each_run_and_a_cross_for_a_blow_up(reduced):
    blown = replace(reduced, outcome=replace(reduced.outcome, blowup_frame=7))
    (axes,) = api.plot(reduced, blown).axes
    named = [line for line in axes.lines if not line.get_label().startswith("_")]
    assert [line.get_label() for line in named] == [reduced.title] * 2
    assert len(axes.lines) == 3
    time, error = named[0].get_data()
    assert time == pytest.approx(0.016 * np.arange(1, 9))
    assert error == pytest.approx(np.clip(reduced.error, 1e-7, 1e3))


def test_runs_of_one_scene_are_shown_together_by_size(full, reduced):
    smaller = api.reduce(full, "spring", "block-deim", 1)
    (shown,) = viewed_scenes(reduced, smaller, full)
    assert [run.r for run in shown.sizes("spring", "block-deim")] == [1, 2]
    assert shown.groups == ["spring"]
    assert np.array_equal(shown.positions, full.positions)
    other = api.run(scene(name="other"))
    assert [one.name for one in viewed_scenes(full, other)] == ["scene", "other"]


@pytest.mark.parametrize("faulty", [(), ("text",), (None,)])
def test_what_is_no_run_is_not_shown(faulty, tmp_path):
    with pytest.raises((SceneError, ConfigurationError), match="view"):
        api.view(tmp_path / "page.html", *faulty)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["reduced", "full"])
def test_records_are_compared_and_hashed_by_identity(reduced, name):
    record = reduced if name == "reduced" else reduced.full
    assert record == record
    assert record != replace(record)
    assert len({record, reduced.full.scene}) == 2


@pytest.mark.parametrize("fault", ["cut", "nan", "times", "reduced"])
def test_a_sealed_run_is_looked_at_like_any_other(reduced, tmp_path, fault):
    """With a right checksum, by whoever wrote it."""
    full = reduced.full
    positions = np.array(full.positions)
    if fault == "cut":
        full = replace(full, positions=positions[:-1])
    elif fault == "nan":
        positions[3, 2, 1] = np.nan
        full = replace(full, positions=positions)
    elif fault == "times":
        full = replace(full, ms=full.ms[:-1])
    outcome = reduced.outcome
    if fault == "reduced":
        outcome = replace(outcome, positions=outcome.positions[:, :-1])
    path = tmp_path / "sealed.h5"
    api.save(replace(reduced, full=full, outcome=outcome), path)
    with pytest.raises(StorageError, match=r"sealed\.h5"):
        api.load(path)


def test_a_run_from_elsewhere_reads_no_other_file(reduced, tmp_path):
    api.save(reduced, tmp_path / "one.h5")
    path = tmp_path / "two.h5"
    with write_hdf5(path) as file:
        file["positions"] = h5py.ExternalLink(str(tmp_path / "one.h5"), "/full")
    with pytest.raises(StorageError, match="leads elsewhere"):
        api.load(path)


@pytest.mark.parametrize("fault", ["cut", "nan"])
def test_positions_that_are_not_whole_are_not_reduced(reduced, fault):
    positions = np.array(reduced.full.positions)
    positions[2, 1, 0] = np.nan
    full = replace(reduced.full, positions=positions[:-1] if fault == "cut" else positions)
    with pytest.raises(PdromError, match="full: positions"):
        api.reduce(full, "spring", r=1)
