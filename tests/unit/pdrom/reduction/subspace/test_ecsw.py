"""Energy-conserving sampling and weighting (ECSW): few weighted elements, and stability.

Its non-negative least squares with early stop are compared with SciPy's and with all supports.
"""

from copy import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from builders import GRAVITY, GROUPS, TOP, make_scene
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.runs import trajectory
from pdrom.reduction.subspace import ecsw
from pdrom.reduction.subspace.columns import build_columns
from pdrom.reduction.subspace.interpolation import SubspaceLocalStep
from pdrom.reduction.subspace.space import ReducedSpace, coordinates
from pdrom.reduction.subspace.training import make_columns

SCENES = {
    name: make_scene({"effect": name, "weight": 1e4}, GRAVITY, mesh=GROUPS[name]) for name in GROUPS
}


def random_columns(scene, rng, k=5):
    modes = rng.standard_normal((scene.mesh.vertices, k))
    none = np.stack([scene.mesh.points] * 2)
    return build_columns(modes, scene.mesh.points, scene.masses, [], none)


@pytest.mark.parametrize("name", SCENES)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**31), spread=st.floats(-2, 1.5))
def test_the_objective_never_rises_for_any_factors(name, seed, spread):
    scene, rng = SCENES[name], np.random.default_rng(seed)
    columns = random_columns(scene, rng)
    group = scene.groups[0]
    elements = np.sort(rng.permutation(group.elements)[: rng.integers(1, group.elements)])
    factors = 10.0 ** rng.uniform(-3, 3, len(elements))
    factors[rng.random(len(elements)) < 0.2] = 0.0
    factors[0] = 1.0
    step = SubspaceLocalStep(group, columns, elements, factors)
    loop = Stepper(ReducedSpace(scene, columns, [step.matrix]), 0.016, 20, [step])
    shape = scene.mesh.points.shape
    q = scene.mesh.points + 10.0**spread * rng.standard_normal(shape)
    state = State(
        coordinates(columns, scene.masses, q),
        coordinates(columns, scene.masses, rng.standard_normal(shape)),
    )
    for frame in range(2):
        state, report = loop.step(state, frame)
        assert np.isfinite(state.positions).all()
        assert (np.diff(report.objective) <= 1e-11 * report.objective[0]).all()


@pytest.fixture(scope="module")
def pulled():
    """Scene of springs and strain under a handle, its run, and a snapshot basis."""
    groups = {"effect": "spring", "weight": 1e4}, {"effect": "strain", "weight": 1e5}
    pull = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}
    mesh = {"kind": "cloth", "rows": 10, "columns": 9}
    scene = make_scene(*groups, pull, TOP, mesh=mesh, frames=12)
    run = trajectory(scene)
    return scene, run, make_columns([scene], run[1:], 4)


def test_the_sampled_equations_satisfy_the_tolerance(pulled):
    scene, _, columns = pulled
    training = ecsw.training_run(scene, columns, np.arange(0, 12, 3))
    for group in scene.groups:
        every = np.arange(group.elements)
        rows, total, *_ = ecsw.training_equations(group, columns, training, every)
        np.testing.assert_allclose(rows.sum(axis=1), total, atol=1e-9)
        forces = exact_forces(group, columns, training)
        counts = []
        tolerances = [0.3, 1e-2, 1e-3]
        found = ecsw.ecsw_elements(group, columns, training, tolerances)
        for tolerance, samples in zip(tolerances, found, strict=True):
            elements, factors = samples.elements, samples.factors
            assert (factors > 0.0).all()
            assert len(np.unique(elements)) == len(elements) < group.elements
            left = forces[:, elements] @ factors - forces.sum(axis=1)
            exact = np.linalg.norm(left) / np.linalg.norm(forces.sum(axis=1))
            assert samples.residual == pytest.approx(exact, rel=1e-6)
            assert exact <= tolerance
            counts.append(len(elements))
        assert counts == sorted(counts)


def exact_forces(group, columns, training) -> np.ndarray:
    """Training equations (m, elements) from their definition, without hashing."""
    lifted, rows = (group.row_weights[:, None] * (group.S @ columns.B)), []
    shape = (group.elements, group.rows_per_element, -1)
    for frame in training:
        group.begin_frame(columns.B @ frame.start)
        for before, after in frame.pairs:
            left = (lifted @ frame.measure.T).reshape(shape)
            right = (group.S @ (columns.B @ after) - group.project(columns.B @ before)).reshape(
                shape
            )
            rows.append(np.einsum("epk,epa->kae", left, right).reshape(-1, group.elements))
    return np.vstack(rows)


@pytest.mark.parametrize(("number", "tolerance"), [(1, 3e-2), (0, 1e-2)], ids=["half", "three"])
def test_candidates_are_part_of_the_group_and_grow_if_they_miss_the_tolerance(
    pulled, monkeypatch, number, tolerance
):
    """Half of one group are candidates, and three elements of the other, which are too few."""
    scene, _, columns = pulled
    group = scene.groups[number]
    training = ecsw.training_run(scene, columns, [2, 8])
    rows, total, *_ = ecsw.training_equations(group, columns, training, np.arange(group.elements))
    candidates = group.elements // 2 if number else 3
    monkeypatch.setattr(ecsw, "CANDIDATES", candidates)
    (samples,) = ecsw.ecsw_elements(group, columns, training, [tolerance])
    elements, factors = samples.elements, samples.factors
    assert number or len(elements) > candidates
    assert len(np.unique(elements)) == len(elements)
    left = rows[:, elements] @ factors - total
    assert np.linalg.norm(left) <= tolerance * np.linalg.norm(total) * (1.0 if number else 1.01)


def test_all_elements_with_factors_of_one_satisfy_the_training_equations(pulled):
    """The training equations hold for all iterates of the run."""
    scene, _, columns = pulled
    steps = [SubspaceLocalStep(group, columns) for group in scene.groups]
    space = ReducedSpace(scene, columns, [step.matrix for step in steps])
    inertia = space.matrix - sum(step.matrix for step in steps)
    frame = ecsw.training_run(scene, columns, [5])[0]
    fixed = np.concatenate(columns.atom_columns)
    free = np.setdiff1d(np.arange(len(inertia)), fixed)
    sums = []
    for before, after in frame.pairs:
        total = np.zeros_like(after)
        for group in scene.groups:
            d = group.S @ (columns.B @ after) - group.project(columns.B @ before)
            total += columns.B.T @ (group.S.T @ (group.row_weights[:, None] * d))
        # (M/h^2)(s - z') is the sum of all elements; s is that of the frame
        sums.append((total + inertia @ after)[free])
    for other in sums[1:]:
        np.testing.assert_allclose(other, sums[0], rtol=1e-9, atol=1e-7 * abs(sums[0]).max())
    energy = frame.measure[:, free]
    np.testing.assert_allclose(
        energy.T @ energy, np.linalg.inv(space.matrix[np.ix_(free, free)]), rtol=1e-8, atol=1e-16
    )
    assert not frame.measure[:, fixed].any()


def test_training_equations_follow_their_definition_element_by_element(rng):
    """Hashing adds each equation, with a sign, to one row."""
    scene = SCENES["strain"]
    group, columns = copy(scene.groups[0]), random_columns(scene, rng, 3)
    group.weights = group.weights * rng.uniform(0.2, 5.0, group.elements)
    k = columns.B.shape[1]
    before, _ = pair = rng.standard_normal((2, k, 3))
    # the constant column has no strain, hence one equation less for each axis
    measure = rng.standard_normal((k - 1, k))
    count = 3 * (k - 1)
    frame = ecsw.TrainingFrame(before, pair[None], measure)
    expected = exact_forces(group, columns, [frame])
    expected /= np.linalg.norm(expected.sum(axis=1))
    rows, total, *_ = ecsw.training_equations(group, columns, [frame], np.arange(group.elements))
    assert rows.shape == (count + 1, group.elements)
    np.testing.assert_allclose(rows.sum(axis=1), total, atol=1e-12)
    np.testing.assert_allclose(rows[-1], group.weights / group.weights.sum(), rtol=1e-14)
    assert np.linalg.matrix_rank(expected) == count < group.elements
    hashing = rows[:-1] @ np.linalg.pinv(expected)
    np.testing.assert_allclose(np.sort(abs(hashing), axis=0)[-1], 1.0, atol=1e-8)
    np.testing.assert_allclose(np.sort(abs(hashing), axis=0)[:-1], 0.0, atol=1e-8)
    assert {-1.0, 1.0} <= set(hashing.round().ravel().tolist())
    some = np.array([3, 0])
    np.testing.assert_array_equal(
        ecsw.training_equations(group, columns, [frame], some)[0], rows[:, some]
    )


def test_a_group_without_force_in_training_keeps_all_elements(pulled):
    """The training states have no force: nothing can be fitted, so all elements stay."""
    scene, _, columns = pulled
    rest = coordinates(columns, scene.masses, scene.mesh.points)
    measure = np.eye(len(rest))
    still = ecsw.TrainingFrame(rest, np.stack([[rest, rest]]), measure)
    for group in scene.groups:
        (samples,) = ecsw.ecsw_elements(group, columns, [still], [1e-2])
        assert samples.elements.tolist() == list(range(group.elements))
        assert (samples.factors == 1.0).all()
        assert samples.residual == 0.0


SMOOTH = np.exp(-np.outer(np.linspace(0.0, 1.0, 60), np.linspace(0.1, 5.0, 200)))


def nnls_path(g: np.ndarray, b: np.ndarray, tolerances: list[float]) -> list:
    search = ecsw._ActiveSet(g, b)
    return ecsw._search(search, tolerances, lambda *_: search.relative_residual)


def stopped(g: np.ndarray, b: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    return nnls_path(g, b, [tolerance])[0][:2]


def dense(support, values, size) -> np.ndarray:
    x = np.zeros(size)
    x[support] = values
    return x


@given(
    m=st.integers(1, 25), e=st.integers(1, 25), seed=st.integers(0, 2**31), scale=st.floats(-6, 6)
)
def test_least_squares_without_tolerance_follow_lawson_and_hanson(m, e, seed, scale):
    rng = np.random.default_rng(seed)
    g = 10.0**scale * rng.standard_normal((m, e)) * 10.0 ** rng.uniform(-2, 2, e)
    b = rng.standard_normal(m)
    before = g.copy(), b.copy()
    support, values = stopped(g, b, 0.0)
    np.testing.assert_array_equal(g, before[0])
    np.testing.assert_array_equal(b, before[1])
    x = dense(support, values, e)
    best, norm = nnls(g, b)
    assert (values > 0.0).all()
    assert (np.diff(support) > 0).all()
    assert np.linalg.norm(g @ x - b) <= norm + 1e-7 * np.linalg.norm(b)
    np.testing.assert_allclose(g @ x, g @ best, atol=1e-5 * np.linalg.norm(b))


def test_least_squares_by_blocks_of_columns_reach_the_same_minimum(rng):
    """The problem is so large that several columns join at a time and that columns leave."""
    g = rng.standard_normal((150, 400)) + 0.2 * rng.standard_normal((150, 1))
    b = g[:, :80].sum(axis=1) + 10.0 * rng.standard_normal(150)
    support, values = stopped(g, b, 0.0)
    best, norm = nnls(g, b)
    assert len(support) > 40
    assert np.linalg.norm(g @ dense(support, values, 400) - b) == pytest.approx(norm, rel=1e-8)
    np.testing.assert_allclose(dense(support, values, 400), best, atol=1e-6)


def test_each_tolerance_of_a_path_is_satisfied_with_few_columns():
    """The right-hand side is a sum of many smooth columns: far fewer of them suffice."""
    g, b = SMOOTH, SMOOTH.sum(axis=1)
    tolerances = [1e-3, 0.5, 0.1, 1e-2, 1e-5]
    path = nnls_path(g, b, tolerances)
    for (support, values, left), tolerance in zip(path, tolerances, strict=True):
        assert (values > 0.0).all()
        assert left <= tolerance
        exact = np.linalg.norm(g[:, support] @ values - b) / np.linalg.norm(b)
        assert left == pytest.approx(exact, rel=1e-6)
    counts = [len(path[i][0]) for i in np.argsort(tolerances)[::-1]]
    assert 0 < counts[0] <= counts[-1] < 15
    assert counts == sorted(counts)
    for one, two in zip(path[1][:2], stopped(g, b, 0.5), strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(
    ("g", "b", "expected"),
    [
        (np.eye(3), np.array([1.0, -1.0, 2.0]), {0: 1.0, 2: 2.0}),
        (np.eye(3), -np.ones(3), {}),
        (np.eye(3), np.zeros(3), {}),
        (np.zeros((3, 4)), np.ones(3), {}),
        (np.column_stack([np.zeros(2), [2.0, 0.0]]), np.array([4.0, 0.0]), {1: 2.0}),
    ],
)
def test_least_squares_have_the_known_solutions(g, b, expected):
    support, values = stopped(g, b, 0.0)
    assert dict(zip(support.tolist(), values.tolist(), strict=True)) == pytest.approx(expected)
