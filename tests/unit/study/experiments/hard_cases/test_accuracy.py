"""Compiled projections against mpmath on hard matrices."""

import numpy as np
import pytest
from hypothesis import given, settings
from mpmath import mp

from strategies import SEEDS
from study.experiments.hard_cases.accuracy import (
    bending_errors,
    groups_on,
    kernel_accuracy,
    matrix_error,
    projected,
    spring_error,
    unit_group,
)
from study.experiments.hard_cases.matrices import CLASSES, VECTORS, rotation
from study.experiments.hard_cases.reference import clamped, digits_for, half_sphere, sized, spring

CLAMPED, SIZED = groups_on("clamped"), groups_on("size")
EPS = np.finfo(float).eps
# A backward stable projection is wrong by a few round-offs times the condition number.
STABLE = 20.0 * EPS

GROUPS = {name: unit_group(name) for name in (*CLAMPED, *SIZED, "spring")}


@settings(max_examples=3)
@given(seed=SEEDS)
@pytest.mark.parametrize("effect", [*CLAMPED, *SIZED])
def test_projections_of_matrices_are_backward_stable(effect, seed):
    """One matrix of every class that the table `kernel_accuracy` has."""
    group, rng = GROUPS[effect], np.random.default_rng(seed)
    for kind in CLASSES:
        error, condition = matrix_error(group, kind.make(rng, group.rows_per_element), kind.unique)
        assert error <= STABLE * max(1.0, condition), kind.name


@pytest.mark.parametrize("kind", VECTORS, ids=lambda k: k.name)
def test_springs(kind):
    rng = np.random.default_rng(5)
    for _ in range(20):
        error, _ = spring_error(GROUPS["spring"], kind.make(rng, 1))
        assert error <= STABLE


def test_bending():
    for name, error, condition in bending_errors(16):
        assert error <= STABLE * max(1.0, condition), name


@pytest.mark.parametrize("effect", [*CLAMPED, *SIZED])
def test_the_unit_element_sees_the_matrix_itself(effect, rng):
    group = GROUPS[effect]
    d = rng.standard_normal((group.rows_per_element, 3))
    y = np.zeros((group.S.shape[1], 3))
    y[1:] = d
    assert np.array_equal(group.S @ y, d)
    inside = rotation(rng)[: len(d)]
    assert projected(group, inside) == pytest.approx(inside, abs=1e-15)


def test_reference_of_known_matrices():
    """Diagonal matrices and a mirrored one have projections that can be written down."""
    with mp.workdps(60):
        p, condition = clamped(np.diag([3.0, 0.5, -0.25]), 0.75, 1.5)
        assert float(condition) == 12.0
        assert np.array(p.tolist(), dtype=float) == pytest.approx(np.diag([1.5, 0.75, 0.75]))
        _, condition = clamped(np.diag([1.0, 1.0, -1.0]), 1.0, 1.0)
        assert condition == mp.inf
    d = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 1e-300]])
    with mp.workdps(digits_for(d)):
        p, _ = clamped(d, 0.75, 1.5)
        expected = np.array([[0.0, 1.5, 0.0], [0.0, 0.0, 0.75]])
        assert np.array(p.tolist(), dtype=float) == pytest.approx(expected)


def test_reference_of_known_sizes():
    """Equal values shrink alike as long as that is nearest; of unequal ones a flat last gives way;
    two values whose product is 1 lie where the normal of the hyperbola meets them."""
    with mp.workdps(60):
        p, condition = sized(np.diag([1.9, 1.9, 1.9]), 0.5, 1.0)
        assert np.array(p.tolist(), dtype=float) == pytest.approx(np.eye(3))
        assert float(condition) == pytest.approx(1.9 / (2.0 - 1.9))
        p, _ = sized(np.diag([100.0, 90.0, -1e-3]), 1.0, 1.0)
        found = np.diag(np.array(p.tolist(), dtype=float))
        assert found == pytest.approx([100.0, 90.0, 1.0 / 9000.0], rel=1e-6)
        inside = np.diag([2.0, 0.5, 1.0]) @ rotation(np.random.default_rng(0))
        p, condition = sized(inside, 0.9, 1.1)
        assert np.array_equal(np.array(p.tolist(), dtype=float), inside)
        assert condition == 1.0
        p, _ = sized(np.array([[3.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), 1.0, 1.0)
        s, t = 3.0, np.linalg.svd(np.array(p.tolist(), dtype=float), compute_uv=False)
        assert t.prod() == pytest.approx(1.0, rel=1e-14)
        assert (s - t[0]) * t[0] == pytest.approx(-t[1] * t[1], rel=1e-12)
        _, condition = sized(np.diag([1.0, 1.0, -1.0]), 1.0, 1.0)
        assert condition == mp.inf


def test_reference_of_known_vectors():
    with mp.workdps(60):
        p = spring(np.array([[0.0, 3e-300, 4e-300]]), np.array([0.0, 0.0, 10.0]))
        assert np.array(p.tolist(), dtype=float) == pytest.approx(np.array([[0.0, 6.0, 8.0]]))
        pole = np.array([0.0, 0.0, 1.0])
        p, _ = half_sphere(np.array([1.0]), np.array([[3.0, 4.0, 12.0]]), 13.0, pole)
        assert np.array(p.tolist(), dtype=float) == pytest.approx(np.array([[3.0, 4.0, 12.0]]))
        p, condition = half_sphere(np.array([1.0]), np.array([[3.0, 4.0, -12.0]]), 5.0, pole)
        assert np.array(p.tolist(), dtype=float) == pytest.approx(np.array([[3.0, 4.0, 0.0]]))
        assert float(condition) == pytest.approx(13.0 / 5.0)


def test_digits_follow_the_range_of_the_entries():
    assert digits_for(np.ones(3)) == digits_for(np.zeros(3)) == 50
    assert digits_for(np.array([1.0, 1e-300])) == 650


def test_the_table_has_every_group_and_class():
    rows = kernel_accuracy(1)
    assert {r["group"] for r in rows} == {*CLAMPED, *SIZED, "spring", "bending"}
    named = {r["matrix_class"] for r in rows if r["group"] == "tetrahedron_strain"}
    assert named == {k.name for k in CLASSES}
    assert all(r["cases"] == 1 for r in rows)
    assert all(r["worst_over_condition"] <= r["worst_relative_error"] for r in rows)


def test_groups_are_those_of_the_registry():
    """A further group that says what it projects on is measured, without a list of names."""
    assert CLAMPED == ["strain", "tetrahedron_strain", "deformation_gradient"]
    assert SIZED == ["volume", "area"]
    assert groups_on("length") == ["spring"]
    assert groups_on("half sphere") == ["bending"]
