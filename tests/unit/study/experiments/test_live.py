"""The engine of the page runs the models that the experiment writes as pdrom does."""

import json

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, make_scene
from node import RUN, evaluate
from pdrom.core.errors import SceneError, StorageError
from pdrom.model.runs import followed
from pdrom.model.scene import Scene
from pdrom.reduction.subspace import exported
from pdrom.reduction.subspace.exported import export_scene
from written_models import write_models

FRAMES = 24
BELOW = 0.02  # distance of the floor below the rest shape, m
WEIGHTS = {"spring": 1e3, "strain": 1e4, "tetrahedron_strain": 1e6, "deformation_gradient": 1e6}


def scene_with(group: str) -> Scene:
    """A body of one group that hangs from its left side, is released and falls on a floor."""
    pins = {"effect": "pins", "select": "left", "until": 9}
    own = {"effect": group, "weight": WEIGHTS[group]}
    settings = {"mesh": GROUPS[group], "frames": FRAMES, "iterations": 4}
    rest = make_scene(own, **settings).mesh.points
    floor = {"effect": "floor", "height": float(rest[:, 1].min()) - BELOW}
    damping = {"effect": "damping", "rate": 0.5}
    return make_scene(GRAVITY, damping, floor, pins, own, **settings)


@pytest.mark.parametrize("group", WEIGHTS)
def test_the_engine_of_the_page_runs_a_model_as_pdrom(group, tmp_path):
    scene = scene_with(group)
    file, model = write_models(scene, tmp_path)
    (made,) = evaluate(RUN, file, frames=FRAMES)
    assert made["elements"] == model.elements_evaluated(scene)
    found = model.columns.B @ np.reshape(made["coordinates"], (FRAMES + 1, -1, 3))
    run = followed(*model.loop(scene_with(group)), FRAMES)
    own = np.stack([model.positions(z) for z in run])
    floor = scene.mesh.points[:, 1].min() - BELOW
    assert own[-1][:, 1].min() == pytest.approx(floor, abs=0.02), "it fell on the floor"
    assert np.abs(found - own).max() < 1e-10
    assert (tmp_path / "test.js").read_bytes() == write_models(scene, tmp_path)[0].read_bytes()


def test_a_large_basis_is_rounded_except_for_the_rows_used_in_computations(tmp_path, monkeypatch):
    monkeypatch.setattr(exported, "DOUBLES", 10)
    monkeypatch.setattr(exported, "PROBES", 4)
    scene = scene_with("strain")
    file, model = write_models(scene, tmp_path)
    basis = evaluate("return new engine.Basis(data, data.bases[0]).B;", file)
    own = model.columns.B
    apart = np.abs(np.reshape(basis, own.shape) - own).max(axis=1)
    needed = exported.needed_vertices(scene, [model])
    assert apart[needed].max() == 0.0
    assert 0.0 <= apart.max() < 1e-6


def test_a_model_file_has_a_header_and_a_handle_offset_is_relative(tmp_path):
    """Offsets are relative to the positions of the vertices when the handle was grasped."""
    file, model = write_models(scene_with("spring"), tmp_path)
    text = file.read_text("utf-8")
    assert text.startswith('pdromLive({"format":1,"scene":"test","title":"A title",')
    content = json.loads(text.removeprefix("pdromLive(").removesuffix(");\n"))
    assert {each["family"] for each in content["models"]} == {"elements"}
    assert content["shown"]["full"]["frames"] == FRAMES + 1
    script = """
    const run = new engine.Run(data, data.models[0], new engine.Basis(data, data.bases[0]));
    for (let frame = 0; frame < 5; frame++) run.step(new Map([[0, [0, 0.1 * frame, 0.2]]]));
    return run.z;
    """
    atom = model.columns.atoms[0]
    found = (model.columns.B @ np.reshape(evaluate(script, file), (-1, 3)))[atom]
    start = scene_with("spring").mesh.points[atom]
    assert found == pytest.approx(start + np.array([0.0, 0.4, 0.2]), abs=1e-12)


def test_a_file_that_is_too_large_names_the_keys(tmp_path, monkeypatch):
    monkeypatch.setattr(exported, "LARGEST", 100)
    with pytest.raises(StorageError, match=r"live\.sizes, live\.tolerances"):
        write_models(scene_with("spring"), tmp_path)
    assert not (tmp_path / "test.js").exists()


@pytest.mark.parametrize(
    ("effect", "settings", "named"),
    [
        ({"effect": "sphere", "centre": [0.0, -2.0, 0.0], "radius": 0.5}, {}, "no 'sphere' .*allo"),
        ({"effect": "translate", "select": "right", "over": 3, "offset": [0, 1, 0]}, {},
         "no 'translate' .*allowed: spring"),
        ({"effect": "area", "weight": 1.0}, {}, "no 'area' .*allowed: spring"),
        (GRAVITY, {"anderson_window": 3}, "anderson_window = 3"),
    ],
)  # fmt: skip
def test_effects_that_the_engine_does_not_know_are_refused(effect, settings, named):
    with pytest.raises(SceneError, match=named):
        export_scene(make_scene({"effect": "spring", "weight": 1.0}, effect, **settings))


MATRICES = """
return given.matrices.map((matrix) => {
  const d = Float64Array.from(matrix), p = new Float64Array(matrix.length);
  engine[given.name](d, p, 0, given.low, given.high);
  return p;
});
"""


@pytest.mark.parametrize(("low", "high"), [(1.0, 1.0), (0.95, 1.1)])
@pytest.mark.parametrize(("name", "rows"), [("clamp2", 2), ("clamp3", 3)])
def test_projections_are_the_nearest_matrices(name, rows, low, high):
    """Also for flat, inverted, tiny and huge matrices if their nearest matrix is unique."""
    rng = np.random.default_rng(0)
    matrices = rng.standard_normal((60, rows, 3))
    matrices[20:40] = np.eye(3)[:rows] + 0.02 * matrices[20:40]
    matrices[40:50, -1] = 1e-9 * matrices[40:50, -1] + matrices[40:50, 0]
    matrices[50:] *= np.geomspace(1e-20, 1e20, 10)[:, None, None]
    given = {"name": name, "low": low, "high": high}
    asked = matrices.reshape(60, -1).tolist()
    found = np.reshape(evaluate(MATRICES, matrices=asked, **given), matrices.shape)
    group = scene_with("strain" if rows == 2 else "tetrahedron_strain").groups[0]
    group.config = group.config.model_copy(update={"minimum": low, "maximum": high})
    expected = group.reference_project(matrices, np.arange(60))
    # the second direction of nearly collinear rows is ill-conditioned
    allowed = np.where((np.arange(60) >= 40) & (np.arange(60) < 50), 1e-5, 1e-11)
    assert (np.abs(found - expected).max(axis=(1, 2)) < allowed).all()
