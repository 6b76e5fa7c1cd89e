"""Sensitivity floor and horizon: chaos is found, and calm runs are left whole."""

from functools import partial

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs.full_order import trajectory
from study.experiments.kit.horizon import horizon
from study.experiments.kit.sensitivity import (
    COLUMNS,
    heldout_floor,
    perturbation_field,
    relative_difference,
    sensitivities,
)


def test_relative_difference_by_hand():
    base = np.zeros((3, 1, 3))
    base[1, 0, 0], base[2, 0, 0] = 3.0, 4.0
    other = base.copy()
    other[1:, 0, 1] = 1.0
    rms = np.sqrt((9.0 + 16.0) / 2.0)
    assert relative_difference(other, base) == pytest.approx([1.0 / rms, 1.0 / rms])


SPRING = {"effect": "spring", "weight": 1e5}
# the sheet is pushed together in its own plane, by its weight: it must buckle, in no preferred way
COMPRESSED = partial(
    make_scene,
    SPRING,
    {"effect": "gravity"},
    {"effect": "pins", "select": "bottom"},
    {"effect": "translate", "select": "top", "offset": [0.0, -0.4, 0.0], "over": 10},
    frames=60,
)
HORIZONTAL = partial(
    make_scene,
    SPRING,
    {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]},
    {"effect": "pins", "select": "top"},
    frames=60,
)


def floor(scene, size=1e-10) -> np.ndarray:
    base = trajectory(scene)
    return relative_difference(trajectory(scene, perturbation_field(scene, size, 1)), base)


def test_chaos_is_detected():
    """In-plane compression amplifies the perturbation by many orders; bending down does not."""
    compressed, horizontal = floor(COMPRESSED()), floor(HORIZONTAL())
    assert horizon(compressed, 1e-3) < len(compressed)
    assert compressed.max() > 1e6 * compressed[0]
    assert horizon(horizontal, 1e-3) == len(horizontal)
    assert horizontal.max() < 1e-7


def test_perturbation_has_its_size_and_its_seed():
    scene = HORIZONTAL()
    field = perturbation_field(scene, 1e-6, 3)
    assert np.linalg.norm(field, axis=1) == pytest.approx(1e-6 * scene.mesh.extent, rel=1e-12)
    np.testing.assert_array_equal(field, perturbation_field(scene, 1e-6, 3))
    assert not np.array_equal(field, perturbation_field(scene, 1e-6, 4))


def test_table_has_every_perturbation_seed_variant_and_frame():
    scene = make_scene(SPRING, {"effect": "gravity"}, {"effect": "pins", "select": "top"}, frames=4)
    table = sensitivities(scene, (1e-10, 1e-6), (1, 2))
    assert list(table.columns) == COLUMNS
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


def test_small_perturbations_act_in_proportion():
    scene = make_scene(SPRING, {"effect": "gravity"}, {"effect": "pins", "select": "top"}, frames=4)
    assert floor(scene, 2e-6) == pytest.approx(2.0 * floor(scene, 1e-6), rel=1e-2)


def test_held_out_floor_is_labelled_as_such():
    scene = make_scene(SPRING, {"effect": "gravity"}, {"effect": "pins", "select": "top"}, frames=3)
    table = heldout_floor(scene, "kick", 1e-10, (1, 2, 3))
    assert set(table.perturbation) == {"kick"}
    assert table.seed.tolist() == [1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert table.relative_difference[table.seed == 2].to_numpy() == pytest.approx(
        relative_difference(
            trajectory(scene, perturbation_field(scene, 1e-10, 2)), trajectory(scene)
        )
    )


def test_a_scene_can_be_measured_twice():
    """Handles remember where they took hold; a second run must not start from there."""
    np.testing.assert_array_equal(trajectory(COMPRESSED()), trajectory(COMPRESSED()))
