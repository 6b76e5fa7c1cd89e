"""Growth of perturbations, predictability horizons, and the contribution of each effect."""

import numpy as np
import pandas as pd
import pytest

from builders import GRAVITY, make_scene, perturbed_runs
from builders import TOP as PINS
from pdrom.core.store import read_table, write_table
from pdrom.model.runs import trajectory
from study.experiments import sensitivity as module
from study.experiments.kit.base import floor_of, horizon, horizons, perturbation_field

SPRING = {"effect": "spring", "weight": 1e5}
HORIZONTAL = ({"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}, PINS)


def test_a_perturbation_has_the_given_size_and_depends_on_the_seed():
    scene = make_scene(SPRING, *HORIZONTAL)
    field = perturbation_field(scene, 1e-6, 3)
    assert np.linalg.norm(field, axis=1) == pytest.approx(1e-6 * scene.mesh.extent, rel=1e-12)
    np.testing.assert_array_equal(field, perturbation_field(scene, 1e-6, 3))
    assert not np.array_equal(field, perturbation_field(scene, 1e-6, 4))


def test_the_table_has_every_perturbation_seed_variant_and_frame():
    scene = make_scene(SPRING, GRAVITY, PINS, frames=4)
    table = module.sensitivities(scene, trajectory(scene), (1e-10, 1e-6), (1, 2))
    assert list(table.columns) == module.COLUMNS
    labels = table.groupby(["perturbation", "seed"], sort=False).frame.agg(list)
    assert list(labels.index) == [
        ("1e-10", 1), ("1e-10", 2), ("1e-06", 1), ("1e-06", 2),
        ("solver", 0), ("iterations x4", 0), ("h/2", 0),
        ("without gravity", 0), ("without pins", 0),
    ]  # fmt: skip
    assert all(frames == [0, 1, 2, 3] for frames in labels)
    largest = table.groupby("perturbation").relative_difference.max()
    assert largest["solver"] < 1e-9 < largest["iterations x4"]
    assert 1e-5 < largest["h/2"] < 1.0
    assert np.isfinite(table.relative_difference).all()
    labelled = pd.concat(module.perturbed(scene, trajectory(scene), 1e-10, (1, 2, 3), "kick"))
    assert set(labelled.perturbation) == {"kick"}
    assert labelled.seed.tolist() == [1] * 4 + [2] * 4 + [3] * 4
    own = table[(table.perturbation == "1e-10") & (table.seed == 2)].relative_difference
    assert labelled.relative_difference[labelled.seed == 2].tolist() == own.tolist()


def test_sensitivities_are_maxima_over_seeds_and_horizons_are_read_as_written(tmp_path):
    """Labels are found as text and, if all labels in the file are numbers, as numbers."""
    floors = perturbed_runs()
    write_table(floors[floors.perturbation == "1e-10"], tmp_path / "sensitivity.csv")
    read = read_table(tmp_path / "sensitivity.csv")
    for table in (floors, read, floors.sample(frac=1.0, random_state=3)):
        assert floor_of(table, "a", 1e-10).tolist() == [0.0, 2e-9, 5e-3, 1.0]
        assert horizons(table, 1e-10, 1e-3) == {"a": 2, "b": 4}
        assert horizons(table, 1e-10, 1e-2) == {"a": 3, "b": 4}
    assert len(floor_of(floors, "b", 1e-6)) == 0
    assert horizons(floors, 1e-6, 1e-3)["a"] == 0
    assert horizons(floors, "heldout", 1e-3) == {"a": 1, "b": 4}


@pytest.mark.parametrize(
    ("floor", "expected"),
    [
        ([], 0), ([1e-3, 1e-3], 2), ([0.0, 2e-3, 0.0, 5e-3], 1), ([0.0, np.nan, 0.0], 1),
        ([0.0, 0.0, np.inf], 2),
    ],
)  # fmt: skip
def test_the_horizon_is_the_first_frame_above_the_threshold(floor, expected):
    assert horizon(np.array(floor), 1e-3) == expected


SOFT = {"effect": "spring", "weight": 1e3}


def test_a_contact_contributes_only_in_contact_and_an_initial_velocity_once():
    floor = {"effect": "floor", "height": 1.9}
    kick = {"effect": "kick", "speed": 1.0, "seed": 1}
    scene = make_scene(SOFT, GRAVITY, floor, kick, frames=40)
    made = module.contributions(scene)
    positions = trajectory(scene)
    touching = made[made.effect == "floor"].force.to_numpy() > 0.0
    on_floor = (np.abs(positions[1:, :, 1] - 1.9) < 1e-12).any(axis=1)
    assert touching.any()
    assert (on_floor | ~touching).all()
    start = made[made.effect == "kick"]
    assert start.frame.tolist() == [0]
    v = scene.starts[0].velocity()
    assert start.energy.item() == pytest.approx(0.5 * float(scene.masses @ (v**2).sum(axis=1)))


def test_every_effect_except_the_only_group_is_omitted_in_turn():
    scene = make_scene(SOFT, {"effect": "bending", "weight": 1.0}, GRAVITY, PINS)
    assert module.removable(scene.config) == ["spring", "bending", "gravity", "pins"]
    assert module.removable(make_scene(SOFT, GRAVITY).config) == ["gravity"]
