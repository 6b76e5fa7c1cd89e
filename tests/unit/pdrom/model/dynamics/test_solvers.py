"""Backends of the global step against dense elimination; Anderson acceleration against GMRES.

Anderson acceleration and GMRES are equivalent on affine maps (Walker, Ni 2011).
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from builders import GRAVITY, GROUPS, make_scene
from pdrom.core.errors import SolverError
from pdrom.model.dynamics.acceleration import Anderson
from pdrom.model.dynamics.solvers import SOLVERS
from pdrom.model.dynamics.system import GlobalSystem
from pdrom.model.runs import trajectory

NAMES = sorted(SOLVERS)


@pytest.mark.parametrize("name", NAMES)
@given(n=st.integers(1, 60), seed=st.integers(0, 2**31))
def test_a_solver_gives_the_solution_of_the_dense_matrix(name, n, seed):
    """One factorisation is used for many solves and does not see later changes of the matrix."""
    rng = np.random.default_rng(seed)
    root = sparse.random_array((n, n), density=min(1.0, 4.0 / n), rng=rng, format="csr")
    matrix = sparse.csr_array(root @ root.T + sparse.eye_array(n))
    dense, solver = matrix.toarray(), SOLVERS[name](matrix, np.arange(n))
    matrix.data[:] = np.nan
    for rhs in rng.standard_normal((2, n, 3)):
        before, out = rhs.copy(), np.full((n, 3), np.nan)
        solver.solve(rhs, out)
        expected = np.linalg.solve(dense, rhs)
        assert np.abs(out - expected).max() <= 1e-10 * max(1.0, np.abs(expected).max())
        np.testing.assert_array_equal(rhs, before)


@pytest.mark.parametrize("pivot", [0.0, -1.0])
@pytest.mark.parametrize("name", NAMES)
def test_a_singular_or_indefinite_matrix_raises_the_same_error_in_every_solver(name, pivot):
    """SuperLU factorises an indefinite matrix without an error; no Cholesky factor of it exists."""
    matrix = sparse.csr_array(np.diag([1.0, pivot, 2.0]))
    message = "size 3: not positive definite" if pivot else "size 3"
    with pytest.raises(SolverError, match=message):
        SOLVERS[name](matrix, np.arange(3))


SCENE = make_scene({"effect": "spring", "weight": 1e4}, {"effect": "strain", "weight": 1e5})


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("fixed", [[], [0], [0, 3, 17], list(range(29)), list(range(30))])
def test_elimination_gives_the_solution_of_the_dense_block_system(name, fixed, rng):
    system = SCENE.system_with(name)
    fixed = np.array(fixed, dtype=np.int64)
    n = SCENE.mesh.vertices
    assert n == 30
    targets, rhs = rng.standard_normal((len(fixed), 3)), rng.standard_normal((n, 3))
    y = np.full((n, 3), np.nan)
    y[fixed] = targets
    elimination = system.eliminate(fixed)
    elimination.set_targets(targets)
    elimination.solve(rhs, y)
    free = np.setdiff1d(np.arange(n), fixed)
    dense = system.matrix.toarray()
    expected = np.linalg.solve(
        dense[np.ix_(free, free)], rhs[free] - dense[np.ix_(free, fixed)] @ targets
    )
    np.testing.assert_array_equal(y[fixed], targets)
    np.testing.assert_allclose(y[free], expected, rtol=1e-9, atol=1e-9)


def test_an_infinite_mass_is_refused():
    masses = SCENE.masses.copy()
    masses[4] = np.inf
    with pytest.raises(SolverError, match="global system"):
        GlobalSystem(masses, 0.016, SCENE.groups)


@pytest.mark.parametrize("name", NAMES)
def test_masses_below_rounding_errors_are_refused_unless_the_body_is_fixed(name):
    """Only inertia resists the translation of a free body, and the matrix loses it to rounding."""
    scene = make_scene({"effect": "spring", "weight": 1e6}, vertex_mass=1e-12)
    with pytest.raises(SolverError, match=r"for the weights|not positive definite"):
        scene.system_with(name).eliminate(np.empty(0, dtype=np.int64))
    elimination = scene.system_with(name).eliminate(np.arange(5))
    elimination.set_targets(scene.mesh.points[:5])
    y = scene.mesh.points.copy()
    rhs = scene.groups[0].S.T @ (scene.groups[0].row_weights[:, None] * scene.groups[0].rest)
    elimination.solve(rhs, y)
    assert y == pytest.approx(scene.mesh.points, abs=1e-9)


def test_anderson_residuals_are_those_of_gmres(rng):
    """With an unlimited window, step m + 1 is the image of the m-th iterate of GMRES, computed by
    dense least squares over the Krylov space of a symmetric contraction."""
    q, _ = np.linalg.qr(rng.standard_normal((12, 12)))
    matrix = q * np.linspace(0.3, 0.95, 12) @ q.T
    shift = np.repeat(rng.standard_normal((12, 1)), 3, axis=1)
    steps, operator = 5, np.eye(12) - matrix
    powers = [np.linalg.matrix_power(operator, i) @ shift[:, 0] for i in range(steps)]
    krylov, _ = np.linalg.qr(np.stack(powers, axis=1))
    found = krylov @ np.linalg.lstsq(operator @ krylov, shift[:, 0], rcond=None)[0]
    acceleration, y = Anderson(20), np.zeros_like(shift)
    acceleration.begin_frame(y)
    for _ in range(steps + 1):
        assert not acceleration.refuse(y, float("nan"))
        y = matrix @ y + shift
        acceleration.combine(y)
    assert np.allclose(y[:, 0], matrix @ found + shift[:, 0], atol=1e-7 * np.abs(y).max())


@pytest.mark.parametrize("group", sorted(GROUPS))
def test_acceleration_keeps_the_fixed_point_and_the_objective_falls(group):
    effects = ({"effect": group, "weight": 1e4}, GRAVITY)
    settings = {"mesh": GROUPS[group], "frames": 3}
    plain = trajectory(make_scene(*effects, **settings, iterations=2000))
    for window in (1, 3, 6):
        fast = make_scene(*effects, **settings, iterations=300, anderson_window=window)
        assert np.abs(trajectory(fast) - plain).max() < 1e-7
        for _, report in fast.stepper().run(fast.initial_state(), range(3)):
            rises = np.diff(report.objective) / np.maximum(np.abs(report.objective[:-1]), 1e-12)
            assert rises.max() < 1e-9


def test_a_rising_objective_is_replaced_by_the_plain_iteration():
    acceleration, y = Anderson(3), np.ones((2, 3))
    acceleration.begin_frame(y)
    for objective in (2.0, 1.0):
        assert not acceleration.refuse(y, objective)
        y = 0.5 * y
        plain = y.copy()
        acceleration.combine(y)
    y += 5.0
    assert acceleration.refuse(y, 3.0)
    assert np.array_equal(y, plain)
