"""Forces, energies and left-out runs of effects: against Newton's second law, and known values."""

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs import trajectory
from study.experiments.sensitivity import EFFECTS, contributions, removable, sensitivities, without

SPRING = {"effect": "spring", "weight": 1e3}
GRAVITY = {"effect": "gravity"}
PINS = {"effect": "pins", "select": "top"}


def table(*effects, **settings):
    scene = make_scene(*effects, **settings)
    return scene, contributions(scene)


def test_a_free_fall_is_gravity_alone():
    scene, made = table(SPRING, GRAVITY, mesh={"kind": "cloth", "rows": 4, "columns": 4}, frames=5)
    assert made.columns.tolist() == EFFECTS
    weight = 9.81 * np.sqrt(np.square(scene.masses).sum())
    force = made.set_index(["effect", "frame"]).force
    assert force["gravity"].to_numpy() == pytest.approx(np.full(5, weight))
    assert force["spring"].max() < 1e-9 * weight
    energy = made[made.effect == "gravity"].energy.to_numpy()
    fallen = 9.81 * 0.016**2 * np.arange(1, 6) * np.arange(2, 7) / 2
    lost = energy[0] - energy
    assert lost == pytest.approx(9.81 * scene.masses.sum() * (fallen - fallen[0]), rel=1e-9)


def test_what_hangs_still_is_carried_by_its_pins():
    """Two vertices below two pins, which in the end carry their own weight, too."""
    mesh = {"kind": "cloth", "rows": 2, "columns": 2}
    damping = {"effect": "damping", "rate": 5.0}
    scene, made = table(
        SPRING, GRAVITY, PINS, damping, mesh=mesh, frames=400, iterations=200
    )  # fmt: skip
    last = made[made.frame == 399].set_index("effect")
    hanging = np.full(2, 9.81 * scene.masses[0])
    assert last.force["spring"] == pytest.approx(np.linalg.norm(hanging), rel=1e-3)
    assert last.force["pins"] == pytest.approx(2.0 * np.linalg.norm(hanging), rel=1e-2)
    assert last.force["damping"] < 1e-3 * last.force["spring"]
    assert np.isnan(last.energy["damping"])
    assert last.energy["spring"] > 0.0


def test_a_contact_acts_where_it_touches_and_a_start_once():
    floor = {"effect": "floor", "height": 1.9}
    scene, made = table(SPRING, GRAVITY, floor, {"effect": "kick", "speed": 1.0, "seed": 1},
                        frames=40)  # fmt: skip
    positions = trajectory(scene)
    touching = made[made.effect == "floor"].force.to_numpy() > 0.0
    on_floor = (np.abs(positions[1:, :, 1] - 1.9) < 1e-12).any(axis=1)
    assert touching.any()
    assert (on_floor | ~touching).all()
    start = made[made.effect == "kick"]
    assert start.frame.tolist() == [0]
    v = scene.starts[0].velocity()
    assert start.energy.item() == pytest.approx(0.5 * float(scene.masses @ (v**2).sum(axis=1)))


def test_effects_of_one_name_are_one():
    again = {"effect": "pins", "select": "bottom", "start": 3}
    _, made = table(SPRING, GRAVITY, PINS, again, frames=6)
    assert (made.groupby(["effect", "frame"]).size() == 1).all()
    assert set(made.role) == {"constraint group", "force", "hold"}


def test_every_effect_but_the_only_group_is_left_out_in_turn():
    bending = {"effect": "bending", "weight": 1e-12}
    mesh = {"kind": "cloth", "rows": 5, "columns": 5, "wave": 0.1}
    scene = make_scene(SPRING, bending, GRAVITY, PINS, mesh=mesh, frames=8)
    assert removable(scene.config) == ["spring", "bending", "gravity", "pins"]
    assert removable(make_scene(SPRING, GRAVITY).config) == ["gravity"]
    made = sensitivities(scene, (1e-10,), (1,))
    drift = made.groupby("perturbation").relative_difference.max()
    assert drift[without("bending")] < 1e-8 < 1e-2 < drift[without("gravity")]
    assert drift[without("spring")] > 1e-3
