"""Errors of positions, shapes and velocities of runs whose errors are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from builders import make_scene, random_rotation
from pdrom.model import metrics
from pdrom.model.metrics import deformation_error
from pdrom.model.runs import trajectory
from pdrom.reduction.deviations import DEVIATIONS, ERRORS, REFERENCE, Yardstick, errors_within
from pdrom.reduction.rerun import displacement_norms

SPRING = {"effect": "spring", "weight": 1e4}
FRAMES = 42  # the last frame is no multiple of STRIDE


def yardstick(*effects, **settings) -> Yardstick:
    """A small sheet of springs that falls for `FRAMES` frames."""
    scene = make_scene({"effect": "gravity"}, *effects, SPRING, frames=FRAMES, **settings)
    return Yardstick(scene, trajectory(scene))


def errors(measure: Yardstick, positions: np.ndarray, end: int = FRAMES) -> dict:
    apart = (positions - measure.reference[: len(positions)])[1:]
    difference = np.linalg.norm(apart, axis=(1, 2))
    found = measure.deviations(SimpleNamespace(positions=positions, difference=difference))
    return errors_within(found, measure.series, end, **measure.units)


FLOOR = {"effect": "floor", "height": 1.5}


def test_the_full_order_run_has_error_zero_and_a_diverged_run_none():
    measure = yardstick(FLOOR)
    found = errors(measure, measure.reference)
    assert tuple(found) == ERRORS
    shapes = [found.pop("shape_error"), found.pop("deformation_error")]
    assert shapes == pytest.approx([0.0, 0.0], abs=1e-12)
    assert [found.pop(f"{name}_converged") for name in ("error", "deformation")] == [None, None]
    assert set(found.values()) == {0.0}
    for left in (FRAMES, 1):
        assert set(errors(measure, measure.reference[:left]).values()) == {None}


def test_a_rigid_motion_is_a_position_error_and_half_the_speed_a_velocity_error():
    """A run of half the displacement has half the norms; a rigid motion leaves the shape."""
    measure = yardstick(FLOOR)
    moved = measure.reference @ random_rotation(np.random.default_rng(3)).T + [0.3, 0.1, -0.2]
    found = errors(measure, moved)
    assert found["relative_error_within_horizon"] > 0.1
    assert found["deformation_error"] == pytest.approx(0.0, abs=1e-10)
    assert errors(yardstick(), moved)["deformation_error"] is None  # the sheet falls and stays flat
    start = measure.reference[0]
    found = errors(measure, start + 0.5 * (measure.reference - start))
    assert found["velocity_error"] == pytest.approx(0.5)
    assert found["relative_error_within_horizon"] == pytest.approx(0.5)


@pytest.mark.parametrize("end", [11, FRAMES])
def test_position_and_deformation_errors_cover_the_same_frames_and_weigh_masses(rng, end):
    measure = yardstick(FLOOR, masses=[{"select": "left", "vertex_mass": 90.0}])
    scene, own = measure.scene, measure.reference
    run, limit = own + rng.normal(scale=0.01, size=(2, *own.shape))
    found = errors(Yardstick(scene, own, limit), run, end)
    for reference, names in ((own, ERRORS[:2]), (limit, ERRORS[-2:])):
        q, p = run[1 : end + 1], reference[1 : end + 1]
        position = np.linalg.norm(q - p) / np.linalg.norm(p - reference[0])
        expected = [position, deformation_error(q, p, scene.mesh.points, scene.masses)]
        assert [found[name] for name in names] == pytest.approx(expected, rel=1e-9)
        assert Yardstick(scene, reference).errors(run, end) == pytest.approx(expected, rel=1e-9)
    assert measure.errors(run[:end], end) == (None, None)


def test_the_energy_drift_of_a_run_at_rest_is_against_the_full_order_energy():
    """It keeps its initial energy; the full-order run falls and keeps the energy of its springs."""
    measure = yardstick({"effect": "damping", "rate": 2.0})
    own = measure.series["energy"]
    found = errors(measure, measure.reference[:1].repeat(FRAMES + 1, axis=0))
    assert found["energy_drift"] == pytest.approx(np.abs(own[0] - own).max())
    assert found["energy_drift"] > 0.1


def test_errors_do_not_depend_on_the_blocks_of_frames(monkeypatch):
    measure = yardstick(FLOOR)
    positions = measure.reference + np.random.default_rng(1).normal(
        scale=0.01, size=measure.reference.shape
    )
    run = SimpleNamespace(positions=positions, difference=displacement_norms(positions))
    found = []
    for block in (1, 7, 1000):
        monkeypatch.setattr(metrics, "BLOCK", block)
        measure = Yardstick(measure.scene, measure.reference)
        found.append({**measure.series, **measure.deviations(run)})
    assert set(found[0]) == {*REFERENCE, *DEVIATIONS}
    for other in found[1:]:
        for name, values in found[0].items():
            np.testing.assert_allclose(other[name], values, rtol=1e-12, atol=1e-13)
