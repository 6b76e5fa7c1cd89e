"""What an iteration with reduced projections does to an error, against the iteration itself."""

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.basis.compute import compute_basis
from pdrom.reduction.local.contraction import Tangent, iteration_numbers
from pdrom.reduction.local.local_step import ReducedLocalStep
from pdrom.reduction.local.reach import reach
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, Sampling, select_path
from study.experiments.kit.boundedness import Compliance, largest_projections

METHODS = {
    "pod": MethodSpec(title="pod", centring="affine", rows="all"),
    "block": MethodSpec(title="block", centring="affine", rows="element"),
    "joint": MethodSpec(title="joint", rows="joint", solve="square"),
    "published": MethodSpec(
        title="published", centring="mean-in-modes", rows="joint", solve="tikhonov"
    ),
}
MOVING = [{"effect": "gravity"}, {"effect": "pins", "select": "left"}]


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


def _tangent(scene: Scene, positions: np.ndarray, frame: int) -> Tangent:
    (group,) = scene.groups
    matrix, held = scene.system.matrix.toarray(), scene.boundaries[0].held(frame)
    return Tangent.at(group, matrix, held, positions[frame], positions[frame + 1])


def _derivative(scene: Scene, reduction: Reduction, y: np.ndarray) -> np.ndarray:
    """T by central differences of the iteration, (3 n, 3 n) of the n free vertices."""
    (group,) = scene.groups
    step = ReducedLocalStep(group, reduction)
    held = scene.boundaries[0].held(0)
    free = np.setdiff1d(np.arange(len(y)), held)
    matrix = scene.system.matrix.toarray()[np.ix_(free, free)]
    columns = []
    for vertex in free:
        for axis in range(3):
            images = []
            for sign in (1.0, -1.0):
                moved, rhs = y.copy(), np.zeros_like(y)
                moved[vertex, axis] += sign * 1e-6
                step.accumulate(moved, rhs)
                images.append(np.linalg.solve(matrix, rhs[free]))
            columns.append((images[0] - images[1]).ravel() / 2e-6)
    return np.array(columns).T


@pytest.mark.parametrize("method", sorted(METHODS))
@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_numbers_are_those_of_the_iteration(group, method):
    """Reference: the derivative of the compiled iteration by differences, all of it."""
    scene, reduction, positions = _case(group, METHODS[method])
    frame = 12
    contraction, radius = iteration_numbers(
        scene.group(group), reduction, [_tangent(scene, positions, frame)]
    )
    t = _derivative(scene, reduction, positions[frame + 1])
    # differences disturb the eigenvalues of a matrix that is far from normal by much
    largest = np.abs(np.linalg.eigvals(t)).max()
    assert radius == pytest.approx(largest, rel=2e-3, abs=2e-3 * contraction)
    free = np.setdiff1d(np.arange(scene.mesh.vertices), scene.boundaries[0].held(0))
    root = np.linalg.cholesky(scene.system.matrix.toarray()[np.ix_(free, free)])
    root = np.kron(root, np.eye(3))
    scaled = root.T @ t @ np.linalg.inv(root.T)
    assert contraction == pytest.approx(np.linalg.norm(scaled, 2), rel=2e-3)
    assert radius <= contraction * (1 + 1e-9)


def test_what_is_frozen_is_that_of_the_frame():
    """Curved bending elements are on the side of the frame's first normals."""
    scene, _, positions = _case("bending", METHODS["pod"])
    first = _tangent(scene, positions, 12)
    scene.groups[0].begin_frame(positions[12] * [1.0, 1.0, -1.0])  # normals turn round
    again = _tangent(scene, positions, 12)
    np.testing.assert_array_equal(first.strain.toarray(), again.strain.toarray())


@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_contraction_is_at_most_gain_times_stiff_share(group):
    """|T|_A <= gamma_W J theta: gain and derivative in the W norm, theta = h^2 w^2 / (1 + h^2 w^2).

    With equal weights gamma_W is the gain itself.
    """
    scene, reduction, positions = _case(group, METHODS["block"])
    g, tangent = scene.group(group), _tangent(scene, positions, 12)
    contraction, _ = iteration_numbers(g, reduction, [tangent])
    strain = np.kron(g.S.toarray(), np.eye(3))
    derivative = tangent.strain.toarray() @ np.linalg.pinv(strain)
    root = np.sqrt(np.repeat(g.row_weights, 3))
    (block,) = reduction.blocks
    full = np.zeros((len(root), len(root)))
    full[:, block.entries] = reduction.v @ block.operator
    gain = np.linalg.norm(root[:, None] * full / root[None, :], 2)
    if np.ptp(g.weights) <= 1e-9 * g.weights.max():
        assert gain == pytest.approx(reduction.gain, rel=1e-6)
    slope = np.linalg.norm(root[:, None] * derivative / root[None, :], 2)
    stiff = np.linalg.eigvalsh(g.system_matrix().toarray()).max()
    theta = 1.0 / (1.0 + scene.system.inertia.min() / stiff)
    assert contraction <= gain * slope * theta * (1 + 1e-6)


def test_below_one_the_iterates_meet():
    """Two starts 1e-3 apart come together at the rate of the contraction number, or faster."""
    scene, reduction, positions = _case("spring", METHODS["pod"])
    (group,) = scene.groups
    contraction, _ = iteration_numbers(group, reduction, [_tangent(scene, positions, 12)])
    assert contraction < 1.0
    steps, space = ReducedLocalStep(group, reduction), scene.space(scene.system)
    fixed, targets = space.fixed(12, positions[12])
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
        for i in range(2):
            rhs = base.copy()
            steps.accumulate(pair[i], rhs)
            after = pair[i].copy()
            elimination.solve(rhs, after)
            pair[i] = after
    rates = np.array(sizes[1:]) / np.array(sizes[:-1])
    assert rates.max() < 1.0


@pytest.mark.parametrize("method", sorted(METHODS))
def test_reach_holds_at_every_state(method, rng):
    """Reference: the static answer to the reduced projections of scrambled states."""
    scene, reduction, _ = _case("strain", METHODS[method])
    g, inverse = scene.group("strain"), Compliance.of(scene).inverse
    bound = reach(g, reduction, largest_projections(g, scene.mesh.points), inverse)
    largest = 0.0
    for spread in (0.1, 1.0, 1e3):
        q = scene.mesh.points + spread * rng.standard_normal(scene.mesh.points.shape)
        reduced = reduction.reconstruct(g.project(q)[None])[0]
        apart = reduced - reduction.basis.mean.reshape(-1, 3)
        force = g.S.T @ (g.row_weights[:, None] * apart)
        largest = max(largest, float(np.sqrt(np.sum(force * (inverse @ force)))))
    assert 0.01 * bound < largest <= bound


def test_a_reduction_that_does_not_exist_reaches_anywhere():
    scene, reduction, positions = _case("spring", METHODS["joint"])
    g = scene.group("spring")
    entries = np.repeat(reduction.sampling.entries[:1], len(reduction.sampling.entries))
    broken = Reduction(
        reduction.basis, Sampling(entries, np.array([entries[0] // 3])), reduction.spec, reduction.r
    )
    largest = largest_projections(g, scene.mesh.points)
    assert reach(g, broken, largest, Compliance.of(scene).inverse) == np.inf
    tangents = [_tangent(scene, positions, 12)]
    assert iteration_numbers(g, broken, tangents) == (np.inf, np.inf)
