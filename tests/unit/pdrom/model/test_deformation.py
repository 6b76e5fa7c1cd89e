"""Deformation error: zero for rigid motions, one for a rigid body, weighted by mass."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pdrom.model.metrics import affine_residuals, deformation_error, shape_differences


@pytest.fixture
def bent(rng):
    """Rest shape (30, 3), deformed shapes (4, 30, 3) and masses."""
    rest = rng.standard_normal((30, 3)) * [3.0, 1.0, 0.5]
    return rest, rest + 0.3 * rng.standard_normal((4, 30, 3)), rng.uniform(0.1, 5.0, 30)


def moved(shapes, rng):
    rotations = Rotation.random(len(shapes), random_state=int(rng.integers(1000))).as_matrix()
    return shapes @ rotations + 10.0 * rng.standard_normal((len(shapes), 1, 3))


def test_a_rigid_motion_of_the_reference_is_no_error_and_a_rigid_body_has_error_one(bent, rng):
    rest, shapes, masses = bent
    assert deformation_error(moved(shapes, rng), shapes, rest, masses) < 1e-12
    rigid = moved(np.broadcast_to(rest, shapes.shape), rng)
    assert deformation_error(rigid, shapes, rest, masses) == pytest.approx(1.0, rel=1e-12)
    assert deformation_error(shapes * [-1.0, 1.0, 1.0], shapes, rest, masses) > 1.0  # mirrored


def test_the_best_rotation_is_no_worse_than_any_other(bent, rng):
    """Reference: the smallest error of many rotations near the best one, with all masses."""
    rest, shapes, masses = bent
    shape = shapes[:1]
    (found,) = shape_differences(rest, shape, masses)
    a, b = (x - masses @ x / masses.sum() for x in (rest, shape[0]))
    best = Rotation.align_vectors(b, a, weights=masses)[0]
    tried = [best, *(Rotation.from_rotvec(0.01 * rng.standard_normal(3)) * best for _ in range(50))]
    weights = masses[:, None] / masses.mean()
    sums = [np.sqrt(np.sum(weights * (r.apply(a) - b) ** 2)) for r in tried]
    assert found == pytest.approx(sums[0], rel=1e-9)
    assert found <= min(sums) * (1 + 1e-9)


def test_splitting_a_vertex_in_two_changes_no_deformation_error(bent, rng):
    rest, shapes, masses = bent
    run = shapes + 0.1 * rng.standard_normal(shapes.shape)
    twice = np.append(np.arange(30), 7)
    halved = masses[twice].copy()
    halved[[7, 30]] *= 0.5
    expected = deformation_error(run, shapes, rest, masses)
    found = deformation_error(run[:, twice], shapes[:, twice], rest[twice], halved)
    assert found == pytest.approx(expected, rel=1e-12)


def test_a_rigid_reference_has_no_error_and_large_coordinates_add_none(bent, rng):
    rest, shapes, masses = bent
    rigid = moved(np.broadcast_to(rest, shapes.shape), rng)
    assert deformation_error(shapes, rigid + 1e-5, rest, masses) is None
    assert deformation_error(shapes[:0], shapes[:0], rest, masses) is None
    with np.errstate(all="raise"):
        blown_up = deformation_error(1e200 * shapes, shapes, rest, masses)
    assert np.isfinite(blown_up)
    assert blown_up > 1e150


@pytest.mark.parametrize("flat", [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
def test_affine_residuals_are_those_of_least_squares_and_zero_for_an_affine_map(bent, rng, flat):
    rest, shapes, masses = bent
    rest = rest * flat
    shapes[0] = rest @ rng.standard_normal((3, 3)) + [1.0, 2.0, 3.0]
    root = np.sqrt(masses / masses.mean())[:, None]
    columns = root * np.c_[rest[:, np.array(flat) > 0.0], np.ones(30)]
    left = [b - columns @ np.linalg.lstsq(columns, b)[0] for b in root * shapes]
    found = affine_residuals(rest, shapes, masses)
    assert found == pytest.approx(np.linalg.norm(left, axis=(1, 2)), rel=1e-9, abs=1e-12)
    assert (found <= shape_differences(rest, shapes, masses)).all()
