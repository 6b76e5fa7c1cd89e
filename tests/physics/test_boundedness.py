"""Bounded projections carry no run away (`study.experiments.kit.boundedness`), tried."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import GROUPS, make_scene
from pdrom.model.scene import Scene
from study.experiments.kit.boundedness import (
    Compliance,
    held_sets,
    largest_projections,
    linear_extent,
)

RELEASED = [
    {"effect": "pins", "select": "left", "until": 20},
    {"effect": "pins", "select": "right", "start": 10, "until": 30},
]
HELD = [{"effect": "pins", "select": "left"}]
FREE: list[dict] = []


class _Drawn:
    """Other random projections in every iteration, on the sphere of each element."""

    def __init__(self, scene: Scene, scale: float) -> None:
        (self._group,) = scene.groups
        self.name, self._scale = self._group.name, scale
        self._rng = np.random.default_rng(7)
        largest = largest_projections(self._group, scene.mesh.points)
        assert largest is not None
        self._largest = largest

    def begin_frame(self, q: np.ndarray) -> None:
        """Nothing is frozen."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        group = self._group
        p = self._rng.standard_normal((group.elements, group.rows_per_element * 3))
        p *= (self._scale * self._largest / np.linalg.norm(p, axis=1))[:, None]
        rhs += group.S.T @ (group.row_weights[:, None] * p.reshape(-1, 3))
        return float("nan")

    @property
    def reach(self) -> float:
        """| p |_W, which bounds | S^T W p |_{K^+}."""
        return self._scale * float(np.sqrt(self._group.weights @ self._largest**2))


def _scene(group: str, *effects: dict, weight: float = 1e4, frames: int = 60) -> Scene:
    own = {"effect": group, "weight": weight}
    return make_scene({"effect": "gravity"}, *effects, own, mesh=GROUPS[group], frames=frames)


@pytest.mark.parametrize("holds", [FREE, HELD, RELEASED], ids=["free", "held", "released"])
@pytest.mark.parametrize("group", ["spring", "strain", "deformation_gradient"])
def test_a_run_with_any_bounded_projections_stays_within_its_bound(group, holds):
    """Random projections of a hundred times the length; reference: the run without projections."""
    scene = _scene(group, *holds)
    drawn, compliance = _Drawn(scene, 100.0), Compliance.of(scene)
    loop = scene.stepper(local_steps=[drawn], track_objective=False)
    rest = scene.stepper(local_steps=[_Nothing()], track_objective=False)
    stiffness = scene.group(group).system_matrix()
    state = without = scene.initial_state()
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame)
        without, _ = rest.step(without, frame)
        e = state.positions - without.positions
        energy = np.sqrt(np.sum(e * (stiffness @ e)))
        assert energy <= (1 + 1e-9) * np.sqrt(frame + 1) * drawn.reach
        assert energy <= (1 + 1e-9) * compliance.growth * drawn.reach
        apart = np.ptp(e, axis=0).max()
        assert apart <= (1 + 1e-9) * energy * np.sqrt(compliance.softest) + 1e-9


class _Nothing:
    name = "nothing"

    def begin_frame(self, q: np.ndarray) -> None:
        """Nothing is frozen."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        return float("nan")


def test_growth_for_ever_is_that_of_a_resonance():
    """The softest mode driven with the signs of its own answer; reference: the recursion itself."""
    scene = _scene("spring", *HELD, weight=3e4, frames=2000)
    compliance, h = Compliance.of(scene), scene.config.time_step
    free = np.setdiff1d(np.arange(scene.mesh.vertices), held_sets(scene)[0])
    stiffness = scene.group("spring").system_matrix().toarray()[np.ix_(free, free)]
    tangent = h * np.sqrt(np.linalg.eigvalsh(stiffness)[0] / scene.masses[0])
    m, angle = np.arange(2000), np.arctan(tangent)
    answer = np.sin(angle) * np.cos(angle) ** m * np.sin((m + 1) * angle)
    x, before = 0.0, 0.0
    for sign in np.sign(answer[::-1]):  # (1 + t^2) x'' - 2 x' + x = t^2 with static answer 1
        x, before = (2.0 * x - before + tangent**2 * sign) / (1.0 + tangent**2), x
    assert x == pytest.approx(np.abs(answer).sum(), rel=1e-9)
    closed = 1.0 / np.tan(angle / 2.0)
    assert 0.6 * closed < x <= closed
    assert x <= compliance.lasting
    assert compliance.growth <= compliance.lasting


@given(st.floats(1e-3, 50.0))
def test_the_poles_of_a_frame_lie_inside_the_unit_circle(tangent):
    """a z^2 - 2 z + 1 with a = 1 + t^2 has the roots cos(t) exp(+-i t)."""
    roots = np.roots([1.0 + tangent**2, -2.0, 1.0])
    angle = np.arctan(tangent)
    expected = np.cos(angle) * np.exp(1j * angle)
    assert np.sort_complex(roots)[-1] == pytest.approx(expected, rel=1e-6)
    assert np.abs(roots).max() < 1.0


@pytest.mark.parametrize("group", sorted(GROUPS))
def test_no_projection_is_larger_than_its_bound(group, rng):
    scene = make_scene({"effect": group, "weight": 1.0}, mesh=GROUPS[group])
    g = scene.group(group)
    largest = largest_projections(g, scene.mesh.points)
    if largest is None:
        # what keeps its size may become as long as it likes; a group need not name its manifold
        assert g.manifold in ("size", None)
        return
    for spread in (1e-3, 1.0, 1e3):
        q = scene.mesh.points + spread * rng.standard_normal(scene.mesh.points.shape)
        g.begin_frame(q)
        norms = np.linalg.norm(g.project(q).reshape(g.elements, -1), axis=1)
        assert (norms <= largest * (1 + 1e-12)).all()


def test_a_group_that_names_no_manifold_has_no_bound():
    scene = make_scene({"effect": "spring", "weight": 1.0})
    group = scene.group("spring")
    group.manifold = None
    assert largest_projections(group, scene.mesh.points) is None


def test_where_nothing_connects_nothing_bounds():
    """Bending leaves the affine motions of a sheet free: a run with changing holds may drift."""
    released = make_scene(*RELEASED, {"effect": "bending", "weight": 1.0}, frames=40)
    assert Compliance.of(released).softest == np.inf
    always = make_scene(*HELD, {"effect": "bending", "weight": 1.0}, frames=40)
    assert np.isfinite(Compliance.of(always).softest)


def test_the_linear_run_without_forces_rests_at_its_own_projections():
    """With p = S q of the rest shape nothing moves; the extent is that of the start."""
    scene = make_scene({"effect": "strain", "weight": 1e4}, *HELD)
    group = scene.group("strain")
    force = group.system_matrix() @ scene.mesh.points
    assert linear_extent(scene, force) == pytest.approx(1.0, abs=1e-9)
