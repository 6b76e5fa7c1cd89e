"""Costs of the effects of a frame: each effect has its cost only."""

import numpy as np
import pytest

from builders import GRAVITY, LEFT, make_scene
from study.experiments.kit import costs as module
from study.experiments.kit.base import GLOBAL, REST, RIGHT

MOVING = (GRAVITY, {"effect": "floor"}, LEFT, {"effect": "pins", "select": "right", "until": 2})
EFFECTS = (*MOVING, {"effect": "spring", "weight": 1e5}, {"effect": "strain", "weight": 1e4})


def test_every_effect_has_a_row_and_the_shares_add_up_to_one():
    scene = make_scene(*EFFECTS)
    table = module.effect_costs(scene, 3, 1, 3)
    assert list(table.columns) == module.COSTS
    expected = {
        "spring": scene.group("spring").elements, "strain": scene.group("strain").elements,
        "gravity": 30, "pins": 2 * 5, "floor": 30, RIGHT: 30, GLOBAL: 30, REST: 30,
    }  # fmt: skip
    assert dict(zip(table.effect, table.elements, strict=True)) == expected
    assert (table.ms_per_frame > 0.0).all()
    assert table.share.sum() == pytest.approx(1.0)


def test_a_timed_effect_and_its_kernel_return_the_values_of_the_effect(rng):
    """Timed effects stay in the compiled loop, so that their times equal those in a run."""
    scene = make_scene(*EFFECTS)
    group = scene.group("strain")
    y = scene.mesh.points + 0.01 * rng.standard_normal(scene.mesh.points.shape)
    own = np.zeros_like(y)
    energy = group.accumulate(y, own)
    stand = module.Timed(group, ("begin_frame", "accumulate"))
    stand.begin_frame(y)
    kernel = module.Timed(group, ("begin_frame",)).local_kernel
    for asked, times in ((stand, 1), (kernel, 1000)):
        for _ in range(times):
            found = np.zeros_like(y)
            assert asked.accumulate(y, found) == energy
        assert (own == found).all()
    assert stand.seconds > 0.0
    stand.reset()
    assert stand.seconds == 0.0
    space = scene.space(scene.system)
    assert space.compiled([module.Timed(g, ("begin_frame",)) for g in scene.groups])[0] is not None


def test_effects_are_omitted_one_at_a_time_and_groups_together():
    # a kick is over before the first frame
    bending = {"effect": "bending", "weight": 1.0}
    scene = make_scene({"effect": "kick", "speed": 0.1, "seed": 1}, *EFFECTS, bending)
    costs = module.effect_costs(scene, 2, 0, 1)
    table = module.left_out(scene, costs, 2, 0, 3)
    assert table.left_out.tolist() == [
        "nothing", "gravity", "floor", "pins", "spring", "strain", "bending", "spring + strain",
        "spring + bending", "strain + bending",
    ]  # fmt: skip
    assert table.groups.tolist() == [3, 3, 3, 3, 2, 2, 2, 1, 1, 1]
    assert list(table.columns) == module.LEFT_OUT
    alone, both = costs.set_index("effect"), table.set_index("left_out").loc["spring + strain"]
    assert both.elements == alone.elements[["spring", "strain"]].sum()
    assert both.own_ms == pytest.approx(alone.ms_per_frame[["spring", "strain"]].sum())
    single = make_scene({"effect": "spring", "weight": 1.0})
    costs = module.effect_costs(single, 1, 0, 1)
    assert len(module.left_out(single, costs, 1, 0, 1)) == 0
