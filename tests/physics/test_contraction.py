"""Contraction of small errors by iterations with reduced projections (a proposition)."""

from itertools import product

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, LEFT, make_scene
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, select_path
from pdrom.reduction.sampling.local_step import ReducedLocalStep

METHODS = {
    "pod": MethodSpec(title="pod", centring="affine", rows="all"),
    "block": MethodSpec(title="block", centring="affine", rows="element"),
}
MOVING = [GRAVITY, LEFT]


def _case(group: str, method: MethodSpec, r: int = 6) -> tuple[Scene, Reduction, np.ndarray]:
    """A scene after a run, with a reduction trained on it, and the run's positions."""
    mesh = dict(GROUPS[group], **({"plane": "xz"} if group in ("spring", "strain") else {}))
    scene = make_scene(*MOVING, {"effect": group, "weight": 1e4}, mesh=mesh, frames=24)
    positions, g = trajectory(scene), scene.group(group)
    snapshots = np.stack([g.project(q) for q in positions[1:]])
    mass = np.ones(snapshots.shape[1])
    basis = compute_basis(snapshots, mass, 1e-13, g.rows_per_element, method)
    sampling = select_path(basis, method, [r])[r]
    return scene, Reduction(basis, sampling, method, r), positions


def _contraction(scene: Scene, reduction: Reduction, y: np.ndarray) -> float:
    """|T|_A, which is the 2-norm of L^T T L^-T with A = L L^T.

    T is found by central differences of the iteration, (3 n, 3 n) of the n free vertices.
    """
    step = ReducedLocalStep(scene.groups[0], reduction)
    free = np.setdiff1d(np.arange(len(y)), scene.boundaries[0].held(0))
    matrix = scene.system.matrix.toarray()[np.ix_(free, free)]

    def image(moved: np.ndarray) -> np.ndarray:
        rhs = np.zeros_like(y)
        step.accumulate(y + moved, rhs)
        return np.linalg.solve(matrix, rhs[free]).ravel()

    columns = []
    for vertex, axis in product(free, range(3)):
        moved = np.zeros_like(y)
        moved[vertex, axis] = 1e-6
        columns.append((image(moved) - image(-moved)) / 2e-6)
    root = np.kron(np.linalg.cholesky(matrix), np.eye(3)).T
    return float(np.linalg.norm(root @ np.array(columns).T @ np.linalg.inv(root), 2))


def _slope(group: ConstraintGroup, y: np.ndarray) -> float:
    """Largest 2-norm of the derivative of an element's projection, by central differences.

    The weights of an element are equal, so that this is also the norm in the weights W.
    """
    shape, elements = (group.elements, group.rows_per_element, 3), np.arange(group.elements)
    strain, size = (group.S @ y).reshape(shape), 3 * group.rows_per_element
    derivative = np.empty((group.elements, size, size))
    for column in range(size):
        moved = np.zeros(shape[1:])
        moved.flat[column] = 1e-6 * np.abs(strain).max()
        ahead = group.reference_project(strain + moved, elements)
        behind = group.reference_project(strain - moved, elements)
        derivative[:, :, column] = (ahead - behind).reshape(-1, size) / (2.0 * moved.max())
    return float(np.linalg.norm(derivative, 2, axis=(1, 2)).max())


@pytest.mark.parametrize("method", ["pod", "block"])
@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_contraction_is_at_most_deim_constant_times_stiff_share(group, method):
    """|T|_A <= gamma_W J theta with theta = h^2 w^2 / (1 + h^2 w^2); W norms of constant and slope.

    With equal weights gamma_W is the DEIM constant.
    """
    scene, reduction, positions = _case(group, METHODS[method])
    g, y = scene.group(group), positions[13]
    root = np.sqrt(np.repeat(g.row_weights, 3))
    (block,) = reduction.blocks
    full = np.zeros((len(root), len(root)))
    full[:, block.entries] = reduction.v @ block.operator
    gain = np.linalg.norm(root[:, None] * full / root[None, :], 2)
    if np.ptp(g.weights) <= 1e-9 * g.weights.max():
        assert gain == pytest.approx(reduction.gain, rel=1e-6)
    stiff = np.linalg.eigvalsh(g.system_matrix().toarray()).max()
    theta = 1.0 / (1.0 + scene.system.inertia.min() / stiff)
    assert 0.0 < _contraction(scene, reduction, y) <= gain * _slope(g, y) * theta * (1 + 1e-5)


def test_two_starts_converge_to_each_other_if_the_contraction_is_below_one():
    """Two starts that differ by 1e-3 approach each other at the rate of the contraction or more."""
    scene, reduction, positions = _case("spring", METHODS["pod"])
    (group,) = scene.groups
    assert _contraction(scene, reduction, positions[13]) < 1.0
    steps, space = ReducedLocalStep(group, reduction), scene.space(scene.system)
    fixed, targets, _ = space.fixed(12, positions[12])
    elimination, matrix = space.eliminate(fixed, targets), scene.system.matrix
    rng = np.random.default_rng(3)
    y, base = positions[13].copy(), space.inertia(positions[13])
    d = 1e-4 * rng.standard_normal(y.shape)
    d[fixed] = 0.0
    pair = [y, y + d]
    sizes = []
    for _ in range(20):
        e = pair[1] - pair[0]
        sizes.append(float(np.sqrt(np.sum(e * (matrix @ e)))))
        for iterate in pair:
            rhs = base.copy()
            steps.accumulate(iterate, rhs)
            elimination.solve(rhs, iterate)
    rates = np.array(sizes[1:]) / np.array(sizes[:-1])
    assert rates.max() < 1.0
