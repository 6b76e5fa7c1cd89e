"""Reduced models in Python: training, runs, errors, files, and refused arguments."""

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import h5py
import numpy as np
import pytest

from builders import GRAVITY, LEFT
from pdrom import api
from pdrom.core.errors import ConfigurationError, NotReducibleError, PdromError, StorageError
from pdrom.core.store import write_hdf5
from places import ROOT

MESH = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
SPRING = {"effect": "spring", "weight": 1e4}
STRAIN = {"effect": "strain", "weight": 1e4}
KICK = {"effect": "kick", "speed": 1.0, "seed": 3}
BALL = {"effect": "sphere", "centre": [0.0, 0.3, 0.1], "radius": 0.2}


def scene(*effects, **keys):
    return api.build_scene(
        effects=[GRAVITY, *(effects or (LEFT, SPRING))], **{"mesh": MESH, "frames": 12, **keys}
    )


@pytest.fixture(scope="module")
def full() -> api.Run:
    return api.run(scene())


@pytest.fixture(scope="module")
def model(full) -> api.Model:
    return api.train(full, modes=8, variations=1, validate=1)


@pytest.mark.parametrize(
    "effects",
    [
        (LEFT, SPRING | {"weight": 3e3}),
        ({"effect": "translate", "select": "left", "offset": [0.3, 0.2, 0.0], "over": 5}, SPRING),
        (LEFT | {"until": 4}, SPRING, {"effect": "floor", "height": 0.0}),
        (LEFT, SPRING, BALL),
        (LEFT, SPRING, KICK, {"effect": "damping", "rate": 0.5}),
    ],
    ids=["weight", "handle", "release and floor", "obstacle", "kick and damping"],
)  # fmt: skip
def test_a_model_of_all_columns_and_elements_repeats_the_full_order_run(full, effects):
    """Weights, masses, forces, fixed vertices and the time step differ from the training."""
    every = api.train(full, basis=np.eye(30), tolerance=None, converged=False)
    other = scene(*effects, time_step=0.011, vertex_mass=3.0, iterations=7)
    expected = api.run(other)
    found = every.run(other)
    assert found.positions == pytest.approx(expected.positions, abs=1e-9)
    errors = found.error(expected)
    assert max(errors.position, errors.deformation) < 1e-8
    assert errors.reference == "the run of 'scene' by the full-order model, 7 iterations a frame"


def test_the_validation_has_the_errors_of_every_trajectory_and_of_replaying(full, model):
    table = model.validation.set_index("trajectory")
    assert table.index.tolist() == ["scene", "scene_variation_1", "scene_validation_1"]
    assert (table[["position_error", "deformation_error"]] < 0.2).all(axis=None)
    assert table.replay_error["scene"] == 0.0
    assert table.replay_error["scene_validation_1"] > 0.1
    assert (table[["ms", "speedup"]] > 0.0).all(axis=None)
    assert model.training.trajectories == ("scene", "scene_variation_1")
    shown = repr(model)
    assert len(shown.splitlines()) == 1
    for words in ("8 modes", "of 69 elements", "residual", "trained on scene, scene_variation_1"):
        assert words in shown


def test_training_frames_are_converged_steps_unless_requested_otherwise():
    stiff = LEFT, SPRING | {"weight": 1e6}
    exact, full = (api.run(scene(*stiff, iterations=k)).positions[-1] for k in (1000, 3))
    one = api.run(scene(*stiff, iterations=3))
    left = []
    for converged in (True, False):
        b = api.train(one, modes=8, tolerance=None, converged=converged).reduced.columns.B
        left.append(np.linalg.norm(exact - b @ np.linalg.lstsq(b, exact)[0]))
    assert np.linalg.norm(exact - full) > 0.1
    assert left[0] < 0.1 * left[1]


def test_the_tolerance_bounds_the_residual_and_a_violated_tolerance_is_reported(full, model):
    (kept,) = model.reduced.samples.values()
    assert kept.residual <= model.training.tolerance == 0.01
    assert model.training.residual == kept.residual
    assert "misses" not in repr(model)
    few = api.train(
        full, modes=8, converged=False, selection=lambda g, b, tolerance: ([3, 1], [9, 9])
    )
    (chosen,) = few.reduced.samples.values()
    assert chosen.elements.tolist() == [1, 3]
    assert chosen.residual > 0.1
    assert "violates the tolerance 0.01" in repr(few)


def test_the_smallest_model_within_an_error_is_returned_or_the_most_accurate_is_named(full):
    found = api.train(full, validate=1, error=0.9, converged=False)
    assert found.reduced.columns.modes == 20
    with pytest.raises(NotReducibleError, match=r"error = 1e-06; the best has \d0 modes"):
        api.train(full, validate=1, error=1e-6, converged=False)
    with pytest.raises(ConfigurationError, match="error requires validate"):
        api.train(full, error=0.1)


def test_a_model_that_diverges_in_validation_satisfies_no_requested_error(full, monkeypatch):
    monkeypatch.setattr("pdrom.api.model.BLOWUP_EXTENT", 1e-3)
    with pytest.raises(NotReducibleError, match=r"errors inf .* blew up"):
        api.train(full, validate=1, error=0.9, converged=False)


def test_an_argument_that_another_argument_overrides_is_refused(full, model):
    reduced = model.run(full.scene)
    blown = replace(full, positions=full.positions[:4], ms=full.ms[:3], blowup_frame=3)
    for words, runs, keys in (
        ("r: ", [full], {"r": 3}),
        ("others: ", [full, full], {"method": "pod"}),
        ("modes, tolerance: ", [full], {"group": "spring", "modes": 3, "tolerance": 0.1}),
        ("modes: ", [full], {"error": 0.1, "validate": 1, "modes": 3}),
        ("modes: ", [full], {"basis": np.eye(30, 2), "modes": 3}),
        ("selection: ", [full], {"tolerance": None, "selection": len}),
        ("selection = 3: ", [full], {"selection": 3}),
        ("validate = True: ", [full], {"validate": True}),
        ("training needs complete full-order runs", [reduced], {}),
        ("blew up in frame 3", [full, blown], {}),
    ):
        with pytest.raises(ConfigurationError, match=words):
            api.train(*runs, **keys)


def test_speed_is_measured_on_all_frames_and_a_model_of_a_rigid_body_is_saved(tmp_path):
    rigid = api.build_scene(effects=[GRAVITY, SPRING], mesh=MESH, frames=4)
    model = api.train(api.run(rigid), modes=4)
    assert model.training.residual == 0.0  # there are no equations to fit
    assert model.validation.deformation_error.isna().all()
    model.save(tmp_path / "rigid.h5")
    assert api.load_model(tmp_path / "rigid.h5").validation.equals(model.validation)
    made = []

    def measure(variants, warmup, repeats):
        made.extend((one.frames, one.warm, warmup, repeats) for one in variants)
        return [{"ms_per_frame": 2.0}, {"ms_per_frame": 5.0}]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pdrom.api.model.measure", measure)
        patch.setattr("pdrom.api.model.process_time", lambda: 0.0)
        assert model.speed(rigid) == {"ms": 2.0, "full_ms": 5.0, "speedup": 2.5, "busy": True}
    assert made == [(4, 1, 1, 3)] * 2


EVERY = {"select": {"kind": "box", "lower": [-9] * 3, "upper": [9] * 3}}
CARRIED = {"effect": "translate", "offset": [0, 1, 0], "over": 3, **EVERY}
BENDING = {"effect": "bending", "weight": 0.1}
NOTHING = {  # effects, frames, group, message
    "at rest": ([], 8, None, "nothing moves: 30 free .* by at most .* m, below 1e-06 of"),
    "no gravity": ([GRAVITY | {"acceleration": [0] * 3}, LEFT], 8, None, "nothing moves: 25 free"),
    "all held": ([GRAVITY, {"effect": "pins", **EVERY}], 8, None, "nothing moves: 0 free"),
    "all carried": ([GRAVITY, CARRIED], 8, None, "nothing moves: 0 free"),
    "flat": ([GRAVITY, LEFT, BENDING], 8, "bending", "'bending': .* rank 0 .* nothing to reduce"),
    "rigid": ([GRAVITY], 8, "spring", "'spring': its projections, .* change by at most"),
    "one frame": ([GRAVITY, LEFT], 1, "spring", "one or two frames have one snapshot"),
}


@pytest.mark.parametrize("name", NOTHING)
def test_a_run_without_anything_to_reduce_is_refused_with_the_reason(name):
    effects, frames, group, words = NOTHING[name]
    full = api.run(api.build_scene(effects=[*effects, SPRING], mesh=MESH, frames=frames))
    for asked in {group, group or "spring"}:
        with pytest.raises(PdromError, match=words):
            api.train(full, group=asked)
    if group is None:
        assert re.search(f"errors none .* none .*{words}", str(full.error(full)))
        api.plot(full, full)


def test_skinning_columns_and_several_runs_enlarge_the_space(full):
    other = api.run(scene(LEFT, SPRING, KICK, name="kicked", frames=7))
    plain = api.train(full, modes=4, tolerance=None, converged=False)
    more = api.train(full, other, modes=4, skinning=6, tolerance=None, converged=False)
    assert more.training.trajectories == ("scene", "kicked")
    assert more.reduced.columns.B.shape[1] == plain.reduced.columns.B.shape[1] + 6
    errors = [m.run(other.scene).error(other).position for m in (plain, more)]
    assert errors[1] < errors[0]


def test_only_fixed_vertices_of_the_training_or_declared_ones_are_accepted(full, model):
    right = scene({"effect": "pins", "select": "right"}, SPRING)
    with pytest.raises(NotReducibleError, match="effect 'pins': holds right, but no training"):
        model.run(right)
    declared = api.train(full, modes=8, tolerance=None, hold=["right"], converged=False)
    found = declared.run(right)
    held = np.flatnonzero(right.mesh.points[:, 0] == right.mesh.points[:, 0].max())
    assert found.positions[-1, held] == pytest.approx(right.mesh.points[held], abs=1e-12)
    with pytest.raises(PdromError, match="selection 'middle'"):
        api.train(full, hold=["middle"])


def test_another_mesh_and_other_groups_are_refused(full, model):
    faulty = {
        "its mesh is not that of the training": scene(mesh=MESH | {"rows": 7}),
        "groups spring, strain; the training has spring": scene(LEFT, SPRING, STRAIN),
        "needs all vertices": scene(LEFT, SPRING, {"effect": "self_collision", "thickness": 0.01}),
    }  # fmt: skip
    for words, other in faulty.items():
        with pytest.raises(PdromError, match=words):
            model.run(other)
    with pytest.raises(ConfigurationError, match="its mesh is not"):
        api.train(full, api.run(faulty["its mesh is not that of the training"]))


def test_a_run_is_compared_only_with_runs_of_the_same_mesh_and_times(full, model):
    for words, other in {
        "the same mesh": scene(mesh=MESH | {"rows": 7}),
        "the same time step": scene(time_step=0.01),
        "the same number of frames": scene(frames=5),
    }.items():
        with pytest.raises(ConfigurationError, match=words):
            full.error(api.run(other))
    with pytest.raises(ConfigurationError, match="a Run is required"):
        full.error(full.positions)
    blown = replace(full, positions=full.positions[:4], ms=full.ms[:3], blowup_frame=3)
    assert blown.error(full) == api.Errors(None, None, full.title)
    assert model.run(full.scene).error(full).position < 0.3


def test_a_saved_model_is_loaded_bit_for_bit(full, model, tmp_path):
    gappy = api.train(full, method="gappy", r=3, validate=1)
    for own in (model, gappy):
        own.save(tmp_path / "a.model.h5")
        again = api.load_model(tmp_path / "a.model.h5")
        assert repr(again) == repr(own)
        assert again.validation.equals(own.validation)
        one, two = (m.run(full.scene, tmp_path / "run.h5") for m in (own, again))
        assert np.array_equal(one.positions, two.positions)
        assert np.array_equal(api.load(tmp_path / "run.h5").positions, two.positions)


def test_a_model_file_of_another_format_or_without_a_model_is_refused(model, tmp_path):
    path = tmp_path / "a.model.h5"
    with pytest.raises(StorageError, match="no such file"):
        api.load_model(path)
    model.save(path)
    with h5py.File(path, "r") as old, write_hdf5(tmp_path / "newer.h5") as new:
        for name in old:
            old.copy(name, new)
        new.attrs.update(old.attrs)
        new.attrs["format"] = 99
    with pytest.raises(StorageError, match="format 99 "):
        api.load_model(tmp_path / "newer.h5")
    api.save(model.run(model.scene), tmp_path / "run.h5")
    with pytest.raises(StorageError, match="contains no model"):
        api.load_model(tmp_path / "run.h5")
    with pytest.raises(StorageError, match="contains no complete run"):
        api.load(path)


def test_the_script_of_the_page_computes_a_frame_with_numpy(model, tmp_path, monkeypatch):
    """The script next to the page of the library, of at most 40 lines."""
    script = (ROOT / "docs" / "frame_of_a_model.py").read_text("utf-8")
    assert len(script.strip().splitlines()) <= 40
    monkeypatch.chdir(tmp_path)
    model.save("sheet.model.h5")
    names: dict = {}
    exec(compile(script, "frame_of_a_model.py", "exec"), names)
    expected = model.run(model.scene, solver="local_global").positions[1]
    assert names["positions"] == pytest.approx(expected, abs=1e-12)


def test_models_of_converged_frames_run_by_newton_steps_others_by_local_global(full, model):
    slow = model.run(full.scene, iterations=2000, solver="local_global")
    assert model.run(full.scene).error(slow).deformation < 1e-3
    loose = api.train(full, modes=8, converged=False)
    one, two = loose.run(full.scene), loose.run(full.scene, iterations=10, solver="local_global")
    assert np.array_equal(one.positions, two.positions)


def test_a_loop_computes_the_frames_of_a_run_and_moves_its_fixed_vertices(full, model):
    loop, moved = model.start(full.scene), model.start(full.scene)
    run, held = model.run(full.scene).positions, full.scene.boundaries[0].vertices
    for expected, hold in zip(run[1:4], ("left", "x_min", "pins"), strict=True):
        moved.move(hold, [0.0, 0.1, 0.0])
        moved.step()
        loop.step()
        assert np.array_equal(loop.positions, expected)
    assert moved.positions[held] == pytest.approx(run[0, held] + [0.0, 0.3, 0.0], abs=1e-12)
    assert np.abs(moved.positions[:, [0, 2]] - loop.positions[:, [0, 2]]).max() > 1e-3
    for hold, shift in (
        ("right", [0, 0, 0]),
        ("left", "up"),
        ("left", 3),
        ("left", [0, np.nan, 0]),
    ):
        with pytest.raises(ConfigurationError, match="move: "):
            moved.move(hold, shift)


def test_the_page_of_a_model_names_the_key_that_adds_a_missing_group(tmp_path):
    sheet = {"effect": "strain", "young": 1e6, "poisson": 0.3, "thickness": 1e-3}
    model = api.train(api.run(scene(LEFT, sheet)), modes=4, converged=False)
    with pytest.raises(PdromError, match=r"no 'area' .added by poisson"):
        model.view(tmp_path / "page.html")


def test_reduced_runs_in_threads_equal_runs_one_after_the_other(full, model):
    other = scene(LEFT, SPRING, KICK)
    alone = [model.run(s).positions for s in (full.scene, other)]
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(model.run, s) for _ in range(3) for s in (full.scene, other)]
    for i, run in enumerate(runs):
        assert np.array_equal(run.result().positions, alone[i % 2])


def test_a_model_may_reduce_the_projections_of_one_group(full):
    rank = api.basis(full, "spring").rank
    best, poor = (api.train(full, method="pod", r=r) for r in (rank, 1))
    errors = [m.run(full.scene).error(full).position for m in (best, poor)]
    assert errors[0] < 0.1 * errors[1]
    assert best.reduced.reduction.gain == pytest.approx(1.0)
    two = api.run(scene(LEFT, SPRING, STRAIN))
    with pytest.raises(ConfigurationError, match="one of spring, strain is required"):
        api.train(two, method="pod")
