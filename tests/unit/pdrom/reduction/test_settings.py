"""Settings of a scene: labels, errors against the converged run, times, and the best ones."""

import numpy as np
import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom.model import coarser
from pdrom.model.runs import converged_run, trajectory
from pdrom.model.scene import Scene
from pdrom.reduction import settings
from pdrom.reduction.deviations import Yardstick
from pdrom.reduction.subspace.model import SubspaceModel, reduced
from pdrom.reduction.subspace.training import make_columns

SPRING = {"effect": "spring", "weight": 1e4}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene(GRAVITY, LEFT, SPRING, frames=8)


@pytest.fixture(scope="module")
def truth(scene) -> Yardstick:
    found = converged_run(scene, 1e-9, 20_000)
    assert found is not None
    return Yardstick(scene, found)


def test_every_mesh_has_every_number_of_iterations_with_its_labels(scene):
    meshes = coarser.grids(scene, (0.8, 0.6))
    made = list(settings.full_order(scene, [(2, 0), (5, 3)], [None, *meshes]))
    names = ["projective", "anderson", "coarser-mesh", "coarser-mesh-anderson", "coarser-mesh"]
    assert [each.labels["method"] for each in made] == [*names, names[3]]
    assert [each.labels["iterations"] for each in made] == [2, 5] * 3
    sizes = [scene.mesh.vertices, *(mesh.scene.mesh.vertices for mesh in meshes)]
    assert [each.labels["vertices"] for each in made] == np.repeat(sizes, 2).tolist()
    # the loop runs with the settings of its labels
    assert (made[0].run(8, 1.0) == trajectory(scene.iterated(2))).all()
    assert (made[1].run(8, 1.0) == trajectory(scene.iterated(5, 3))).all()
    own = [meshes[0].positions(y) for y in trajectory(meshes[0].scene.iterated(2))]
    assert made[2].run(8, 1.0) == pytest.approx(np.stack(own), abs=1e-14)


def test_errors_fall_with_iterations_to_zero_and_a_diverged_setting_has_none(
    scene, truth, monkeypatch
):
    counts = [(1, 0), (5, 0), (1000, 0)]
    found = [each.errors(truth) for each in settings.full_order(scene, counts)]
    assert max(found[-1][1:]) < 1e-6
    assert found[0][1] > found[1][1] > 1e-4
    assert found[0][2] > found[1][2] > 1e-4
    monkeypatch.setattr(settings, "BLOWUP_EXTENT", 0.1)
    assert settings.loop_of({}, scene).errors(truth) == (None, None, None)


def test_a_model_of_all_columns_equals_the_full_order_run_or_the_converged_step(scene, truth):
    columns = make_columns([scene], truth.reference[1:], 0, 0, np.eye(scene.mesh.vertices), ())
    model = SubspaceModel(columns)
    five, exact = (reduced({}, scene, model, *how) for how in ((5, False), (None, True)))
    assert five.run(8, 1.0) == pytest.approx(trajectory(scene.iterated(5)), abs=1e-9)
    assert exact.errors(truth)[1] < 1e-4
    assert five.output is not None


def test_a_setting_is_timed_in_its_unknowns_from_states_of_all_vertices(scene):
    (mesh,) = coarser.grids(scene, (0.6,))
    setting = settings.loop_of({"method": "x"}, mesh.scene, mesh, steps=2)
    state = scene.initial_state()
    variant = setting.variant({"scene": "s"}, 3, [(state, 4)])
    assert variant.labels == {"scene": "s", "method": "x"}
    assert variant.frames == 6
    ((own, step),) = variant.starts
    assert step == 8
    assert own.positions == pytest.approx(mesh.scene.mesh.points)
    assert variant.output(own.positions) == pytest.approx(scene.mesh.points)


def test_the_best_settings_are_those_that_no_other_setting_dominates():
    error, cost = [1.0, 0.5, 0.5, 0.7, np.inf, 0.1], [1.0, 2.0, 2.0, 3.0, 0.5, 9.0]
    assert settings.pareto(error, cost) == [True, True, True, False, True, True]
    assert settings.pareto([], []) == []
