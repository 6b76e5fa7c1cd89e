"""Scenes with another time step and stiffness, and the basis sizes of a study."""

import pytest

from builders import GRAVITY, make_scene
from study.experiments.kit.base import resolve_ranks, varied

SPRING = {"effect": "spring", "weight": 1e4}


def test_schedules_keep_their_seconds_and_only_the_reduced_weight_changes():
    pins = {"effect": "pins", "select": "top", "until": 10}
    effects = (GRAVITY, pins, SPRING, {"effect": "strain", "weight": 1e3})
    scene = make_scene(*effects, frames=20, reduce={"spring": {"train": 4}})
    assert varied(scene.config, 0.016, 1.0, 0.32, (2, 100)) == scene.config
    config = varied(scene.config, 0.004, 100.0, 0.32, (2, 100))
    assert (config.time_step, config.frames) == (0.004, 80)
    assert config.effects[1].until == 40
    weights = {e.effect: e.weight for e in config.effects if hasattr(e, "weight")}
    assert weights == {"spring": 1e6, "strain": 1e3}
    for h, frames in ((1e-3, 50), (0.016, 20), (0.2, 5)):  # within their limits
        assert varied(scene.config, h, 1.0, 0.32, (5, 50)).frames == frames


@pytest.mark.parametrize(
    ("asked", "rank", "sizes"),
    [
        ([6, 10, 20, "full"], 69, [6, 10, 20, 69]),
        (["full", 10, 6], 8, [6, 8, 10]),
        ([6, "full"], 6, [6]),
        ([6, "full"], 0, [6]),
        (["full"], 0, []),
    ],
)
def test_basis_sizes_ascend_and_full_is_the_rank(asked, rank, sizes):
    assert resolve_ranks(asked, rank) == sizes
