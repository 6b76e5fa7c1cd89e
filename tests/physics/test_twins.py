"""Rounding errors do not decide the trajectories of the scenes on which verdicts are based."""

import pytest

from pdrom.model.runs import trajectory
from places import ROOT
from study.experiments.kit.base import perturbation_field
from study.experiments.sensitivity import relative_difference
from study.pipeline.scenes import load_bound_scene

WELL_POSED = sorted(
    path.stem
    for path in (ROOT / "config" / "scenes").glob("*.yaml")
    if path.stem.endswith(("_twin", "_oop")) or path.stem == "bend_curved"
)


def floor(name: str) -> float:
    """Largest relative difference of two runs that start 1e-10 of the extent apart."""
    scene = load_bound_scene(ROOT, name)
    other = trajectory(scene, perturbation_field(scene, 1e-10, seed=1))
    return float(relative_difference(other, trajectory(scene)).max())


@pytest.mark.parametrize("name", WELL_POSED)
def test_the_sensitivity_of_a_predictable_scene_stays_below_one_in_ten_thousand(name):
    assert floor(name) < 1e-4
