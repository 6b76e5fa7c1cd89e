"""The reduced local step agrees with the dense formula, for an invented group and real groups.

Reduced runs equal the full-order run if the basis is complete, and end where they diverge.
"""

import numpy as np
import pytest
from scipy import sparse

from builders import TOP, Pushing, make_scene
from pdrom.model.runs import trajectory
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.rerun import displacement_norms, rerun
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.sampling.local_step import ReducedLocalStep, replace_group
from places import CONFIG

PRESETS = load_methods(CONFIG / "methods.yaml")
N, ELEMENTS, P, R = 9, 12, 2, 4
ROWS = ELEMENTS * P


class InventedGroup:
    """A group whose projections are set for each call of `next`, and that records requests."""

    name = "invented"
    elements = ELEMENTS
    rows_per_element = P
    local_kernel = None
    frame_lagged = False

    def __init__(self, projections: np.ndarray) -> None:
        rng = np.random.default_rng(8)
        self.S = sparse.random_array((ROWS, N), density=0.3, rng=rng, format="csr")
        self.row_weights = np.repeat(rng.uniform(1.0, 9.0, ELEMENTS), P)
        self.projections, self.for_run = projections, lambda: self
        self.asked: list[np.ndarray] = []
        self.frames: list[np.ndarray | None] = []

    def begin_frame(self, q: np.ndarray, elements: np.ndarray | None = None) -> None:
        self.frames.append(elements)

    def project_elements(self, y: np.ndarray, elements: np.ndarray) -> np.ndarray:
        self.asked.append(elements)
        return self.projections.reshape(ELEMENTS, P, 3)[elements].reshape(-1, 3)

    def full(self, p: np.ndarray) -> np.ndarray:
        """S^T W p (N, 3)."""
        return self.S.T @ (self.row_weights[:, None] * p)


def reduction_of(spec: MethodSpec) -> Reduction:
    """Reduction of size R made from seven snapshots (rows, 3)."""
    rng = np.random.default_rng(1)
    p = rng.standard_normal((7, ROWS, 3)) + 1.0
    basis = compute_basis(p, rng.uniform(0.5, 2.0, ROWS), 0.0, P, spec)
    return Reduction(basis, select(basis, spec, R), spec, R)


def near(points: np.ndarray, count: int) -> np.ndarray:
    """Positions (count, N, 3) about those of the rest shape."""
    return points + 0.05 * np.random.default_rng(4).standard_normal((count, *points.shape))


def whole(group, p: np.ndarray, preset: str) -> Reduction:
    """Reduction of a group's snapshots by a preset, with all modes."""
    spec = PRESETS[preset]
    basis = compute_basis(p, np.ones(p.shape[1]), 0.0, group.rows_per_element, spec)
    return Reduction(basis, select(basis, spec, basis.rank), spec, basis.rank)


def added(step: ReducedLocalStep) -> np.ndarray:
    rhs = np.zeros((N, 3))
    step.accumulate(np.zeros((N, 3)), rhs)
    return rhs


VARIANTS = {
    **PRESETS,
    "mass": MethodSpec(title="t", weighting="mass", centring="affine", rows="element"),
    "mass-joint": MethodSpec(title="t", weighting="mass", rows="joint"),
    "per-axis": MethodSpec(title="t", layout="per-axis", centring="affine", rows="joint"),
    "per-axis-all": MethodSpec(title="t", layout="per-axis", rows="all"),
    "published-all": MethodSpec(title="t", centring="mean-in-modes", rows="all"),
}


@pytest.mark.parametrize("name", sorted(VARIANTS))
def test_the_reduced_local_step_adds_the_reconstruction_from_sampled_elements_only(name):
    """S^T W of `Reduction.reconstruct`, for projections outside the space.

    It is added to the right-hand side, and the energy is unknown.
    """
    reduction = reduction_of(VARIANTS[name])
    other = np.random.default_rng(5).standard_normal((3, ROWS, 3))
    group = InventedGroup(other[0])
    step = ReducedLocalStep(group, reduction)
    for projections, wanted in zip(other, reduction.reconstruct(other), strict=True):
        group.projections = projections
        scale = np.abs(group.full(wanted)).max()
        np.testing.assert_allclose(added(step), group.full(wanted), atol=1e-11 * scale)
        rhs = np.full((N, 3), 7.0)
        assert np.isnan(step.accumulate(np.zeros((N, 3)), rhs))
        np.testing.assert_allclose(rhs - 7.0, added(step), atol=1e-12 * np.abs(rhs).max())
    assert step.name == "invented"
    step.begin_frame(np.zeros((N, 3)))
    rhs = added(step)
    for asked in group.asked:
        np.testing.assert_array_equal(asked, reduction.elements)
    if reduction.spec.rows == "all" or reduction.spec.oversampling * R >= ELEMENTS:
        assert group.frames == [None]
        assert len(reduction.elements) == ELEMENTS
    else:
        np.testing.assert_array_equal(group.frames, [reduction.elements])
        assert len(reduction.elements) <= R
        # projections of other elements have no influence
        hidden = group.projections.reshape(ELEMENTS, P, 3).copy()
        hidden[np.setdiff1d(np.arange(ELEMENTS), reduction.elements)] = np.nan
        group.projections = hidden.reshape(ROWS, 3)
        np.testing.assert_array_equal(added(step), rhs)


@pytest.mark.parametrize("preset", ["pod", "deim", "block-deim"])
def test_the_compiled_reduced_step_equals_the_python_code(preset, group_scene):
    """The lift is timed separately."""
    group, q = group_scene.groups[0].for_run(), group_scene.mesh.points
    group.begin_frame(q)
    *positions, y = near(q, 6)
    reduction = whole(group, np.stack([group.project(x) for x in positions]), preset)
    step, total = ReducedLocalStep(group, reduction), np.zeros_like(q)
    step.begin_frame(q)
    assert np.isnan(step.accumulate(y, total))
    step.lift_seconds = 0.0
    for _ in range(1000):
        step.accumulate(y, np.zeros_like(q))
    assert step.lift_seconds > 0.0
    group._accumulator = lambda: None
    plain, rhs = ReducedLocalStep(group, reduction), np.zeros_like(q)
    assert plain.local_kernel is None
    plain.accumulate(y, rhs)
    assert np.abs(total - rhs).max() <= 1e-12 * np.abs(rhs).max()


EFFECTS = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}, TOP


def scene_with(*groups: str, frames: int = 4, **settings):
    effects = [{"effect": name, "weight": 1e4} for name in groups]
    return make_scene(*EFFECTS, *effects, frames=frames, iterations=3, **settings)


class Watched:
    """A group that keeps the projections of every iterate."""

    def __init__(self, group) -> None:
        self.group, self.name, self.seen = group, group.name, []

    def begin_frame(self, q):
        self.group.begin_frame(q)

    def accumulate(self, y, rhs):
        self.seen.append(self.group.project(y))
        return self.group.accumulate(y, rhs)


@pytest.mark.parametrize("group", ["spring", "strain"])
def test_a_basis_of_all_iterates_repeats_the_full_order_run(group):
    """Every projection is in the span, so that the orthogonal projection changes no value."""
    scene = scene_with("spring", "strain")
    watched = Watched(scene.group(group))
    reference = trajectory(scene, local_steps=replace_group(scene, group, watched))
    snapshots = np.stack(watched.seen)
    assert len(snapshots) == 12
    chosen = scene.group(group)
    for method in ("pod", "qdeim", "block-qdeim"):
        reduction = whole(chosen, snapshots, method)
        steps = replace_group(scene, group, ReducedLocalStep(chosen, reduction))
        result = rerun(scene, *steps_of(scene, steps), reference, 10.0)
        assert result.blowup_frame is None
        assert result.frames == scene.config.frames
        motion = np.linalg.norm(displacement_norms(reference))
        assert np.linalg.norm(result.difference) < 1e-10 * reduction.gain * motion


def steps_of(scene, steps):
    """Step loop with these local steps, and the initial state."""
    return scene.stepper(local_steps=steps, track_objective=False), scene.initial_state()


def test_full_local_steps_repeat_the_run_to_the_bit():
    scene = scene_with("spring", "strain")
    reference = trajectory(scene)
    result = rerun(scene, *steps_of(scene, scene.groups), reference, 10.0)
    np.testing.assert_array_equal(result.positions, reference)
    np.testing.assert_array_equal(result.difference, np.zeros(4))
    extent = np.ptp(reference[1:], axis=1).max(axis=1) / scene.mesh.extent
    np.testing.assert_allclose(result.extent, extent, rtol=1e-14)
    assert result.max_extent == extent.max()


def test_a_run_that_grows_beyond_the_limit_ends_with_that_frame():
    scene = scene_with("spring", frames=30)
    reference = trajectory(scene)
    push = np.linspace(-2e5, 2e5, scene.mesh.vertices)[:, None] * [1.0, 0.0, 0.0]
    whole = rerun(scene, *steps_of(scene, [Pushing(lambda: push)]), reference, np.inf)
    assert (whole.blowup_frame, whole.frames) == (None, 30)
    limit = float(np.median(whole.extent))
    result = rerun(scene, *steps_of(scene, [Pushing(lambda: push)]), reference, limit)
    first = int(np.flatnonzero(whole.extent > limit)[0])
    assert 0 < first < 29
    assert result.blowup_frame == first
    assert result.frames == first + 1 == len(result.extent)
    np.testing.assert_array_equal(result.positions, whole.positions[: first + 2])
    np.testing.assert_array_equal(result.difference, whole.difference[: first + 1])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e308])
def test_a_run_that_becomes_infinite_ends_before_that_frame(bad):
    scene = scene_with("spring")
    result = rerun(scene, *steps_of(scene, [Pushing(lambda: bad)]), trajectory(scene), 2.0)
    assert result.blowup_frame == 0
    assert np.isfinite(result.positions).all()
    assert result.frames <= 1
    assert np.isfinite(result.max_extent)
