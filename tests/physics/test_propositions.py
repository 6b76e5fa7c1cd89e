"""Numerical examples for the manuscript's propositions on sampling and interpolation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh
from test_boundedness import growth

from builders import make_scene
from pdrom.model.dynamics.stepper import State
from pdrom.model.runs import trajectory
from pdrom.reduction.basis import Basis
from pdrom.reduction.method import MethodSpec
from pdrom.reduction.sampling import Reduction, Sampling
from pdrom.reduction.sampling.gappy_pod_e import eigenvalue_growth
from pdrom.reduction.subspace.model import Samples, SubspaceModel
from pdrom.reduction.subspace.training import make_columns
from strategies import SEEDS

SHEET = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}


# A falling (sampled) objective bounds nothing across frames.


def test_the_energy_may_rise_although_the_objective_falls():
    """A sheet of springs moves through its centre: all springs turn over within one frame.

    One spring with a = h^2 w / m has the factor (1 + a/(1+a))^2 + a/(1+a)^2, between 1 and 4.
    """
    scene = make_scene({"effect": "spring", "weight": 1e7}, iterations=30, frames=1)
    points = scene.mesh.points - scene.mesh.points.mean(axis=0)
    velocities = -1.001 * points / scene.config.time_step
    start = State(points, velocities)
    after, report = scene.stepper().step(start, 0)
    assert (np.diff(report.objective) <= 1e-9 * report.objective[0]).all()
    before, later = _energy(scene, start), _energy(scene, after)
    assert 1.5 < later / before < 4.0


def _energy(scene, state):
    (group,) = scene.groups
    potential = group.accumulate(state.positions, np.zeros_like(state.positions))
    return potential + 0.5 * float(np.sum(scene.masses[:, None] * state.velocities**2))


def test_coordinates_without_sampled_stiffness_move_on_uniformly():
    """Only mass acts on coordinates in the kernel of the sampled stiffness: nothing bends them.

    The objective falls in every frame nevertheless, also at a stiffness of 1e8.
    """
    kick = {"effect": "kick", "speed": 1.0, "seed": 3}
    scene = make_scene(kick, {"effect": "spring", "weight": 1e8}, mesh=SHEET, frames=30)
    columns = make_columns([scene], trajectory(scene)[1:], 8)
    samples = {"spring": Samples(np.array([0, 7]), np.array([20.0, 20.0]))}
    loop, state = SubspaceModel(columns, samples).loop(scene)
    group = scene.group("spring")
    strain = (group.S @ columns.B)[[0, 7]]
    mass = columns.B.T @ (scene.masses[:, None] * columns.B)
    kernel = np.linalg.svd(strain)[2][2:]
    moved, h = kernel @ mass, scene.config.time_step
    first, speed = moved @ state.positions, moved @ state.velocities
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame)
    expected = first + scene.config.frames * h * speed
    assert moved @ state.positions == pytest.approx(expected, abs=1e-7 * np.abs(first).max())
    assert len(kernel) > 1


def test_a_sampled_run_stays_within_the_bound_of_the_subspace():
    """The theorem in z: |e_n| <= alpha beta in the norm of B^T K_xi B, e to projections of zero."""
    kick = {"effect": "kick", "speed": 3.0, "seed": 3}
    scene = make_scene(kick, {"effect": "spring", "weight": 1e6}, mesh=SHEET, frames=60)
    columns = make_columns([scene], trajectory(scene)[1:], 8)
    elements, factors = np.arange(0, 40, 5), np.linspace(1.0, 9.0, 8)
    model = SubspaceModel(columns, {"spring": Samples(elements, factors)})
    loop, state = model.loop(scene)
    h, B = scene.config.time_step, columns.B
    stretch = np.sqrt(factors * 1e6)[:, None] * (scene.group("spring").S @ B)[elements]
    mass, stiffness = B.T @ (scene.masses[:, None] * B), stretch.T @ stretch
    squares = eigh(stiffness, mass, eigvals_only=True)
    angles = np.arctan(h * np.sqrt(squares[squares > 1e-9 * squares[-1]]))
    rest = scene.group("spring").S @ scene.mesh.points
    beta = np.sqrt(np.sum(factors * 1e6 * np.sum(rest[elements] ** 2, axis=1)))
    bound = growth(angles, 20_000) * beta
    linear, before = state.positions.copy(), state.positions - h * state.velocities
    system, largest = mass / h**2 + stiffness, 0.0
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame)
        linear, before = np.linalg.solve(system, mass @ (2 * linear - before) / h**2), linear
        largest = max(largest, np.linalg.norm(stretch @ (state.positions - linear)))
    assert 0.05 * bound < largest <= bound


# Bounds by the DEIM constant, in each variant.


def _reduction(v: np.ndarray, elements: np.ndarray, method: MethodSpec) -> Reduction:
    """Reduction of a basis with one row an element (three entries)."""
    count, r = len(v) // 3, v.shape[1]
    basis = Basis(v, np.zeros(len(v)), np.ones(r), r, 1e-15, 1, (True,) * 3)
    entries = (3 * np.asarray(elements)[:, None] + np.arange(3)).ravel()
    return Reduction(basis, Sampling.of_entries(entries, 1, count, repeats=True), method, r)


def _orthonormal(rng: np.random.Generator, n: int, r: int) -> np.ndarray:
    return np.linalg.qr(rng.standard_normal((n, r)))[0]


@pytest.mark.parametrize("separate", [False, True], ids=["shared", "by axis"])
@given(seed=SEEDS, r=st.integers(1, 6), t=st.floats(1e-8, 1.0), times=st.integers(1, 9))
def test_the_deim_constant_bounds_the_error_of_a_regularised_solve(separate, seed, r, t, times):
    """The bound: sqrt(1 + m gain^2) times the best error, t / (sigma^2 + t) times the basis part.

    A row is sampled m ``times``. The projections are large there, so that m matters.
    The bounds of a basis that is orthonormal for each axis, as of `published`, add up.
    """
    rng = np.random.default_rng(seed)
    parts = [slice(a, None, 3) for a in range(3)] if separate else [slice(None)]
    v, p = np.empty((45, r)), rng.standard_normal(45)
    for part in parts:
        v[part] = _orthonormal(rng, 45 // len(parts), r)
    keys = {"coefficients": "per-axis"} if separate else {}
    method = MethodSpec(title="x", rows="element", solve="tikhonov", tikhonov=t, **keys)
    elements = rng.permutation(15)[: r + 2]
    p[3 * elements[0]] = 30.0
    made = _reduction(v, np.append(elements, elements[:1].repeat(times - 1)), method)
    error = np.linalg.norm(p - made.reconstruct(p.reshape(1, 15, 3)).ravel())
    inside = [v[part].T @ p[part] for part in parts]
    outside = [p[part] - v[part] @ c for part, c in zip(parts, inside, strict=True)]
    assert len(made.blocks) == len(parts)
    sigma = min(np.linalg.svd(block.matrix, compute_uv=False)[-1] for block in made.blocks)
    bias = t / (sigma**2 + t) * np.linalg.norm(inside)
    best = np.linalg.norm(np.concatenate(outside))
    assert error <= (np.sqrt(1.0 + times * made.gain**2) * best + bias) * (1 + 1e-9)


# The smallest eigenvalue and a block of rows; test_gappy_pod_e.py bounds its growth.


@given(SEEDS, st.integers(2, 4), st.integers(1, 4))
def test_equal_eigenvalues_rise_only_together(seed, multiplicity, size):
    """With gap zero the bound is zero, and so is the growth if a block has too few rows."""
    rng = np.random.default_rng(seed)
    r = multiplicity + 2
    q = _orthonormal(rng, r, r)
    values = np.concatenate([np.full(multiplicity, 0.5), [2.0, 3.0]])
    gram, block = (q * values) @ q.T, rng.standard_normal((size, r))
    (growth,) = eigenvalue_growth(block[None], (block @ q[:, 0])[None], q[:, 0], 0.0)
    true = np.linalg.eigvalsh(gram + block.T @ block)[0] - 0.5
    assert growth == 0.0
    if size < multiplicity:
        assert true == pytest.approx(0.0, abs=1e-12)
    else:
        assert true > 0.0


# A bounded DEIM constant requires a share of the mesh.


@given(SEEDS, st.integers(1, 8), st.integers(1, 20))
def test_a_bounded_deim_constant_needs_a_minimum_share_of_the_elements(seed, r, count):
    """m >= e / (mu gain^2); mu is the ratio of largest to mean share of the modes in an element."""
    rng = np.random.default_rng(seed)
    v = _orthonormal(rng, 60, r)
    elements = rng.permutation(20)[: max(count, -(-r // 3))]
    gain = _reduction(v, elements, MethodSpec(title="x", rows="element")).gain
    leverage = np.sum(v.reshape(20, -1) ** 2, axis=1)
    mu = leverage.max() / (r / 20)
    assert len(elements) * mu * gain**2 >= 20 * (1 - 1e-9)


@pytest.mark.parametrize("count", [1, 5, 20])
def test_evenly_spread_modes_need_exactly_the_minimum_share_of_the_elements(count, rng):
    """For e blocks of orthonormal columns over sqrt(e), m of them have the constant sqrt(e / m)."""
    blocks = [_orthonormal(rng, 3, 3) / np.sqrt(20) for _ in range(20)]
    v = np.concatenate(blocks)
    elements = rng.permutation(20)[:count]
    made = _reduction(v, elements, MethodSpec(title="x", rows="element"))
    assert made.gain == pytest.approx(np.sqrt(20 / count))
