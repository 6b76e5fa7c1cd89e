"""The package from Python: the page's example, what runs hold, and files that are read back."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pdrom import api
from pdrom.core.errors import ConfigurationError, PdromError, RankError, StorageError
from pdrom.model.runs.full_order import trajectory
from pdrom.reduction.snapshots import training_frames
from places import CONFIG, ROOT

PAGE = (ROOT / "docs" / "python.md").read_text("utf-8")
EFFECTS = [
    {"effect": "gravity"},
    {"effect": "pins", "select": "left"},
    {"effect": "spring", "weight": 1e5},
]
KEYS = {"mesh": {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}, "frames": 12}


@pytest.fixture(scope="module")
def full() -> api.FullRun:
    """A short run of a small sheet."""
    return api.run(api.build_scene(effects=EFFECTS, **KEYS))


def test_the_pages_example_runs_and_is_short(tmp_path, monkeypatch, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(code.strip().splitlines()) <= 15
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "python.md", "exec"), {})
    said = capsys.readouterr().out
    assert "rank of the projections" in said
    assert said.count("error at the end") == 3
    assert (tmp_path / "errors.png").stat().st_size > 10_000


def test_the_page_has_every_name_and_no_function_more():
    functions = {n for n in api.__all__ if n[0].islower()}
    assert set(re.findall(r"`([a-z_]+)\(", PAGE.split("| name |")[1])) == functions
    assert len(functions) <= 10
    assert all(f"`{name}`" in PAGE for name in set(api.__all__) - functions)


def test_a_run_is_that_of_the_step_loop(full):
    assert np.array_equal(full.positions, trajectory(full.scene))
    assert full.ms.shape == (12,)
    group = full.scene.group("spring")
    assert full.snapshots["spring"].p.shape == (6, group.elements, 3)
    assert len(training_frames(12, 6)) == 6


def test_the_full_rank_reproduces_the_run_and_few_modes_do_not(full):
    """Snapshots train the basis at even frames; at full rank the rest is interpolation error."""
    rank = api.basis(full, "spring").rank
    best, poor = (api.reduce(full, "spring", "pod", r) for r in (rank, 1))
    assert best.outcome.finite
    assert best.gain == pytest.approx(1.0)
    assert best.error[-1] < 0.1 * poor.error[-1]
    with pytest.raises(RankError, match=f"r = {rank + 1}"):
        api.reduce(full, "spring", "pod", rank + 1)


def test_files_are_read_back(full, tmp_path):
    reduced = api.reduce(full, "spring", "block-deim", 2)
    api.save(reduced, tmp_path / "reduced.h5")
    read = api.load(tmp_path / "reduced.h5")
    assert isinstance(read, api.ReducedRun)
    assert (read.title, read.gain, read.ms) == (reduced.title, reduced.gain, reduced.ms)
    assert read.outcome.positions == pytest.approx(reduced.outcome.positions, abs=1e-6)
    assert read.error == pytest.approx(reduced.error, rel=1e-5)
    assert read.full.scene.config == full.scene.config
    stored = api.run(full.scene, tmp_path / "full.h5")
    again = api.load(tmp_path / "full.h5")
    assert np.array_equal(stored.positions, again.positions)
    assert np.array_equal(again.scene.mesh.triangles, full.scene.mesh.triangles)


@pytest.mark.parametrize("action", ["none", "report", "stop", "fall-back"])
def test_what_a_guard_saw_is_read_back(full, tmp_path, action):
    guard = api.GuardSettings(action=action, alarm="estimate", threshold=1e-9)
    reduced = api.reduce(full, "spring", "block-deim", 1, guard=guard)
    assert (reduced.seen.count > 0) == (action != "none")
    api.save(reduced, tmp_path / "guarded.h5")
    # which group gave the alarm is the run's own
    assert api.load(tmp_path / "guarded.h5").seen == replace(reduced.seen, group=None)


def test_a_file_without_a_run_is_refused(tmp_path):
    with pytest.raises(StorageError, match="no such file"):
        api.load(tmp_path / "none.h5")


def test_a_scene_of_the_project_and_one_with_its_mesh_beside_it(tmp_path):
    assert api.load_scene(CONFIG / "scenes" / "spring_oop.yaml").mesh.vertices == 400
    (tmp_path / "square.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3\nf 1 3 4\n")
    path = tmp_path / "own.yaml"
    path.write_text(
        "name: own\ntitle: Own\nframes: 4\nmesh: {kind: file, path: square.obj}\n"
        "effects: [{effect: spring, weight: 1.0}]\n"
    )
    assert api.load_scene(path).mesh.vertices == 4


@pytest.mark.parametrize(
    ("faulty", "words"),
    [
        (lambda full: api.build_scene(**KEYS), "key 'effects' is missing"),
        (lambda full: api.reduce(full, "spring", "gapy"), "did you mean 'gappy'"),
        (lambda full: api.reduce(full, "strain"), "no group 'strain'"),
        (lambda full: api.basis(replace(full, snapshots={}), "spring"), "stored no snapshots"),
        (lambda full: api.load_scene(Path("none.yaml")), "no such configuration file"),
    ],
)
def test_faults_are_named(full, faulty, words):
    with pytest.raises(PdromError, match=words):
        faulty(full)


def test_a_mesh_that_is_missing_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match=r"none\.obj"):
        api.build_scene(
            tmp_path, mesh={"kind": "file", "path": "none.obj"}, frames=4, effects=EFFECTS
        )
