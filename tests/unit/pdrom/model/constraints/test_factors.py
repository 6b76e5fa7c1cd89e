"""Weights by selection: the elements inside get them, in energies, systems and runs."""

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.model.runs import trajectory
from study.experiments.kit.scenes import varied

BOX = {"kind": "plane", "point": [0.1, 0, 0], "normal": [-1, 0, 0]}


def scene_with(group, *factors, weight=1e4):
    return make_scene(
        {"effect": group, "weight": weight, "factors": list(factors)}, mesh=GROUPS[group]
    )


@pytest.mark.parametrize("group", GROUPS)
def test_elements_inside_are_multiplied_and_others_left_alone(group):
    plain, changed = scene_with(group), scene_with(group, {"select": BOX, "factor": 7.0})
    inside = changed.mesh.points[:, 0] <= 0.1 + 1e-6
    elements = inside[plain.groups[0].element_vertices(plain.mesh)].all(axis=1)
    ratio = changed.groups[0].weights / plain.groups[0].weights
    assert 0 < elements.sum() < len(elements)
    assert ratio == pytest.approx(np.where(elements, 7.0, 1.0))


@pytest.mark.parametrize("group", GROUPS)
def test_all_elements_times_a_factor_are_another_weight(group):
    """Same run as with the product as weight, through the compiled kernels."""
    every = {"select": {"kind": "component"}, "factor": 4.0}
    runs = []
    for scene in (scene_with(group, every), scene_with(group, weight=4e4)):
        start = 0.1 * np.random.default_rng(5).standard_normal(scene.mesh.points.shape)
        runs.append(trajectory(scene, perturbation=start))
    assert np.array_equal(runs[0], runs[1])


def test_another_stiffness_keeps_the_factors():
    config = scene_with("spring", {"select": BOX, "factor": 7.0}).config
    config = config.model_copy(update={"reduce": {"spring": None}})
    stiffer = varied(config, config.time_step, 10.0, 0.1, (1, 100))
    (effect,) = stiffer.effects
    assert (effect.weight, effect.factors) == (1e5, config.effects[0].factors)
