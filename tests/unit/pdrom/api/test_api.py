"""The package in Python: the example of its page, runs, their files and pictures, and errors."""

import copy
import inspect
import pickle
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from builders import GRAVITY, LEFT
from pdrom import api
from pdrom.api.pictures import viewed_scenes
from pdrom.api.records import Snapshots
from pdrom.api.runs import Basis, FrameReport
from pdrom.core.errors import ConfigurationError, PdromError
from pdrom.model.mesh.types import Mesh
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.snapshots import training_frames
from places import ROOT
from study.pipeline.scenes import load_bound_scene

PAGE = (
    (ROOT / "docs" / "library.md").read_text("utf-8").split("## From Python")[1].split("\n## ")[0]
)
EFFECTS = [GRAVITY, LEFT, {"effect": "spring", "weight": 1e5}]
KEYS = {"mesh": {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}, "frames": 12}


@pytest.fixture(scope="module")
def full() -> api.Run:
    return api.run(api.build_scene(effects=EFFECTS, **KEYS))


@pytest.fixture(scope="module")
def reduced(full: api.Run) -> api.Run:
    return api.train(full, method="block-deim", r=2).run(full.scene)


def test_the_example_of_the_page_runs_and_is_short(tmp_path, monkeypatch, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(code.strip().splitlines()) <= 15
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "library.md", "exec"), {})
    said = capsys.readouterr().out
    assert "Model(a model of 'scene' (10 modes" in said
    assert (tmp_path / "errors.png").stat().st_size > 10_000


def test_the_page_lists_every_public_name_and_no_other_function():
    functions = {n for n in api.__all__ if n[0].islower()}
    assert (
        set(re.findall(r"`([a-z_]+)\(", PAGE.split("These functions")[1].split("The objects")[0]))
        == functions
    )
    assert len(functions) <= 12
    assert all(f"`{name}`" in PAGE for name in set(api.__all__) - functions)
    for kind in (api.Run, api.Errors, api.Model, Snapshots, Basis, Scene, Mesh, FrameReport):
        (row,) = re.findall(rf"^\* `{kind.__name__}`.*(?:\n  .*)*", PAGE, re.MULTILINE)
        own = {field.name for field in fields(kind)}
        own |= {n for n, v in inspect.getmembers(kind) if kind is not Scene or not callable(v)}
        assert {name for name in own if name[0] != "_"} <= set(re.findall(r"`(\w+)`", row)), row


def test_a_run_has_the_positions_of_the_step_loop(full):
    assert np.array_equal(full.positions, trajectory(full.scene))
    assert full.ms.shape == (12,)
    group = full.scene.group("spring")
    assert full.snapshots["spring"].p.shape == (6, group.elements, 3)
    assert len(training_frames(12, 6)) == 6


def test_saved_runs_are_loaded_unchanged(full, reduced, tmp_path):
    blown = replace(reduced, positions=full.positions[:4], ms=full.ms[:3], blowup_frame=3)
    for run in (full, reduced, blown):
        api.save(run, tmp_path / "run.h5")
        api.save(api.load(tmp_path / "run.h5"), tmp_path / "run.h5")
        read = api.load(tmp_path / "run.h5")
        assert np.array_equal(read.frame_error, run.frame_error, equal_nan=run is full)
        assert (read.method, read.blowup_frame) == (run.method, run.blowup_frame)
        assert np.array_equal(read.positions, run.positions)
        assert np.array_equal(read.ms, run.ms)
        assert read.scene.config == full.scene.config
        for name, own in run.snapshots.items():
            assert np.array_equal(read.snapshots[name].p, own.p)
    with pytest.raises(PdromError, match="has no snapshots"):
        api.basis(read, "spring")
    seen: list[int] = []
    stored = api.run(full.scene, tmp_path / "full.h5", lambda frame, report: seen.append(frame))
    assert seen == list(range(12))
    again = api.load(tmp_path / "full.h5")
    assert np.array_equal(stored.positions, again.positions)
    assert np.array_equal(again.scene.mesh.triangles, full.scene.mesh.triangles)


@pytest.mark.parametrize("folder", ["own", "config/scenes"])
def test_the_path_of_a_mesh_means_the_same_in_every_folder(tmp_path, monkeypatch, folder):
    own = tmp_path / folder
    own.mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    (own / "square.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3\nf 1 3 4\n")
    path = Path(folder, "own.yaml")
    path.write_text(
        "name: own\ntitle: Own\nframes: 4\nmesh: {kind: file, path: square.obj}\n"
        "effects: [{effect: spring, weight: 1.0}]\n"
    )
    assert api.load_scene(path).mesh.vertices == 4
    if folder == "config/scenes":
        assert load_bound_scene(Path(), "own").mesh.vertices == 4
    (own / "square.obj").rename(tmp_path / "square.obj")
    with pytest.raises(ConfigurationError, match=rf"no such mesh file \(looked in {own}\)"):
        api.load_scene(path)


def spring(full, *args, **keys) -> api.Model:
    return api.train(full, group="spring", **dict(zip(["method", "r"], args, strict=False)), **keys)


FAULTY = {
    "no effects": (lambda *_: api.build_scene(**KEYS), "key 'effects' is missing"),
    "method misspelt": (lambda full, _: spring(full, "gapy"), "did you mean 'gappy'"),
    "group not there": (lambda full, _: api.train(full, group="strain"), "no group 'strain'"),
    "no snapshots": (lambda full, _: spring(replace(full, snapshots={})), "has no snapshots"),
    "mesh not there": (lambda _, p: given({"kind": "file", "path": "x.obj"}, folder=p), r"x\.obj"),
    "positions cut": (lambda full, _: replace(full, positions=full.positions[:-1]), "positions of"),
    "r zero": (lambda full, _: spring(full, r=0), "train: r = 0"),
    "no run": (lambda full, _: api.train(full.scene), "full = Scene.*a Run is"),
    "basis of a triangle": (lambda full, _: api.train(full, basis=np.eye(3)), "basis: float64"),
    "basis NaN": (
        lambda full, _: api.train(full, basis=np.full((30, 2), np.nan)), "basis: entry .* is nan",
    ),
    "plot of a run": (lambda full, _: api.plot(full), "at least one run"),
    "run into a folder": (lambda full, p: api.run(full.scene, p), "cannot be written .a folder"),
    "mass NaN": (lambda *_: given((SQUARE, HALVES), vertex_mass=np.nan), "vertex_mass"),
    "mesh nothing": (lambda *_: given(None), "key 'mesh' is"),
    "corner beyond": (lambda *_: given((SQUARE, [[0, 1, 4]])), "the corners"),
    "corner of 65 bits": (lambda *_: given((SQUARE, np.uint64([[0, 1, 2**63]]))), "the corners"),
    "cells of floats": (lambda *_: given((SQUARE, [[0.0, 1.0, 2.0]])), "cells: an array"),
    "cells of edges": (lambda *_: given((SQUARE, [[0, 1]])), r"required: \(n, 3\) or \(n, 4\)"),
    "empty cells": (lambda *_: given((SQUARE, np.empty((0, 3), int))), "both are required"),
    "points NaN": (lambda *_: given((np.array(SQUARE) * np.nan, HALVES)), "vertex 0 lies at"),
    "ragged points": (lambda *_: given(([[0.0], [1.0, 2.0]], HALVES)), "points: an array"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTY)
def test_wrong_arguments_are_named_in_one_line(full, tmp_path, name):
    call, words = FAULTY[name]
    with pytest.raises(PdromError, match=words) as caught:
        call(full, tmp_path)
    assert len(str(caught.value).splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


SQUARE = [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]
HALVES = [[0, 1, 2], [0, 3, 2]]
CORNER = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def given(mesh, folder=".", **keys) -> Scene:
    """A scene on a mesh, without fixed vertices."""
    return api.build_scene(folder, mesh=mesh, frames=4, effects=[EFFECTS[0], EFFECTS[2]], **keys)


def test_a_mesh_is_given_as_arrays(tmp_path):
    scene = given((SQUARE, HALVES))
    assert np.array_equal(scene.mesh.points, SQUARE)
    assert len(scene.mesh.edges()) == 5
    solid = given((np.array(CORNER), np.array([[0, 2, 1, 3]], dtype=np.uint64)))
    assert (len(solid.mesh.tetrahedra), len(solid.mesh.triangles)) == (1, 4)
    larger = given((2.0 * np.array(SQUARE), HALVES))
    assert larger.config != scene.config  # otherwise two meshes would count as one scene
    run = api.run(scene, tmp_path / "given.h5")
    read = api.load(tmp_path / "given.h5")
    assert np.array_equal(read.positions, run.positions)
    assert read.scene.config == scene.config
    assert np.array_equal(read.scene.mesh.triangles, scene.mesh.triangles)


def copies(value):
    return copy.deepcopy(value), pickle.loads(pickle.dumps(value))


def test_scenes_and_runs_are_copied_and_pickled(full, reduced):
    assert full.scene.system is not None  # data that a run has cached do not prevent copies
    for scene in copies(full.scene):
        assert scene is not full.scene
        assert scene.config == full.scene.config
        assert np.array_equal(trajectory(scene), full.positions)
    for again in copies(reduced):
        assert repr(again) == repr(reduced)
        assert np.array_equal(again.positions, reduced.positions)
    model = api.train(full, modes=4, converged=False)
    for one in copies(model):
        assert np.array_equal(one.run(full.scene).positions, model.run(full.scene).positions)


def test_a_picture_has_a_line_for_each_run_and_a_cross_for_a_blow_up(full, reduced):
    blown = replace(reduced, positions=full.positions[:8], ms=full.ms[:7], blowup_frame=7)
    (axes,) = api.plot(full, reduced, blown).axes
    named = [line for line in axes.lines if not line.get_label().startswith("_")]
    assert [line.get_label() for line in named] == [reduced.method] * 2
    assert len(axes.lines) == 3
    time, error = named[0].get_data()
    assert time == pytest.approx(0.016 * np.arange(1, 13))
    assert error == pytest.approx(np.clip(reduced.errors(full), 1e-7, 1e3))


def test_runs_of_one_scene_are_shown_together(full, reduced):
    (shown,) = viewed_scenes(reduced, full)
    assert [run.title for run in shown.runs] == [reduced.method]
    assert np.array_equal(shown.positions, full.positions)
    (alone,) = viewed_scenes(reduced)
    assert np.array_equal(alone.positions, reduced.positions)
    other = api.run(api.build_scene(effects=EFFECTS, **KEYS, name="other"))
    assert [one.name for one in viewed_scenes(full, other)] == ["scene", "other"]
