"""Certificates hold where they are given, and are refused where nothing is known."""

import numpy as np
import pytest

from builders import GROUPS, make_scene
from pdrom.model.dynamics.stepper import State
from pdrom.model.scene import Scene
from pdrom.reduction.asked.certificate import ImplicitStep, ceilings
from pdrom.reduction.asked.chained import chained, growth
from pdrom.reduction.asked.level import Level

SMOOTH = ("spring", "strain", "deformation_gradient")
CONVERGED = Level(400, 5)


def hanging(group: str, **settings: object) -> Scene:
    flat = {"plane": "xz"} if GROUPS[group]["kind"] == "cloth" else {}
    held = [{"effect": "gravity"}, {"effect": "pins", "select": "left"}]
    elastic = {"effect": group, "weight": 1e4}
    return make_scene(*held, elastic, mesh=GROUPS[group] | flat, frames=12, **settings)


def states(scene: Scene, level: Level) -> list[State]:
    start = scene.initial_state()
    return [start, *level.on(scene).run(start, range(scene.config.frames))]


def converged(scene: Scene, before: State, frame: int) -> np.ndarray:
    (end,) = CONVERGED.on(scene).run(before, range(frame, frame + 1))
    return end.positions


@pytest.mark.parametrize("group", SMOOTH)
def test_the_gradient_is_that_of_the_objective(group, rng):
    scene = hanging(group)
    before, after = states(scene, Level(3))[4:6]
    step = ImplicitStep(scene, before, 4)
    space = scene.space(scene.system)
    s = space.predict(before.positions, before.velocities, scene.config.time_step)
    held = scene.boundaries[0].held(4)
    free = np.setdiff1d(np.arange(scene.mesh.vertices), held)
    y, direction = after.positions.copy(), np.zeros_like(after.positions)
    y[free] += 0.02 * rng.standard_normal((len(free), 3))
    direction[free] = 1e-6 * rng.standard_normal((len(free), 3))

    def objective(q: np.ndarray) -> float:
        energy = sum(each.accumulate(q, np.zeros_like(q)) for each in scene.groups)
        return energy + space.inertia_energy(q - s)

    slope = objective(y + direction) - objective(y - direction)
    assert slope == pytest.approx(2.0 * np.sum(step.gradient(y) * direction[free]), rel=1e-4)


@pytest.mark.parametrize("group", SMOOTH)
def test_no_derivative_in_the_ball_is_above_its_ceiling(group, rng):
    """Reference: central differences of the projection at random places of the ball."""
    scene = hanging(group)
    g, y = scene.groups[0], scene.mesh.points + 0.02 * rng.standard_normal(scene.mesh.points.shape)
    strain = (g.S @ y).reshape(g.elements, g.rows_per_element, 3)
    radii = 0.1 * np.linalg.norm(strain, axis=(1, 2)) * rng.random(g.elements)
    ceiling, every = ceilings(g, strain, radii), np.arange(g.elements)
    for _ in range(20):
        away = rng.standard_normal(strain.shape)
        away *= (radii / np.linalg.norm(away, axis=(1, 2)))[:, None, None]
        slopes = np.empty_like(ceiling)
        for i in range(strain[0].size):
            moved = np.zeros_like(strain[0])
            moved.flat[i] = 1e-6
            ends = [g.reference_project(strain + away + sign * moved, every) for sign in (1, -1)]
            slopes[:, :, i] = ((ends[0] - ends[1]) / 2e-6).reshape(g.elements, -1)
        slopes = 0.5 * (slopes + slopes.transpose(0, 2, 1))
        assert np.linalg.eigvalsh(ceiling - slopes).min() > -1e-6


@pytest.mark.parametrize("group", SMOOTH)
def test_a_certified_frame_is_as_near_as_it_says(group):
    """Reference: 400 accelerated iterations from the same state."""
    scene = hanging(group)
    for level in (Level(5), Level(40, 5)):
        run, ratios = states(scene, level), []
        for frame in range(scene.config.frames):
            end = run[frame + 1].positions
            least, bound = ImplicitStep(scene, run[frame], frame).certify(end)
            if np.isfinite(bound):
                assert least > 0.0
                defect = np.linalg.norm(end - converged(scene, run[frame], frame))
                assert defect <= bound + 1e-12
                ratios.append(bound / max(defect, 1e-12))
    # nearly converged ends are certified, and the bound says something
    assert len(ratios) >= scene.config.frames // 2
    assert np.median(ratios) < 100.0


def test_what_is_not_convex_smooth_or_free_is_refused():
    scene = hanging("spring")
    step, rest = ImplicitStep(scene, scene.initial_state(), 0), scene.mesh.points
    least, bound = step.certify(0.5 * rest)
    assert least < 0.0
    assert np.isnan(bound)
    collapsed = rest.copy()
    a, b = scene.mesh.edges()[0]
    collapsed[b] = collapsed[a]
    assert np.isnan(step.certify(collapsed)).all()
    bent = make_scene({"effect": "bending", "weight": 1.0}, mesh=GROUPS["bending"])
    assert np.isnan(ImplicitStep(bent, bent.initial_state(), 0).certify(bent.mesh.points)).all()
    # a sheet that stands: its lowest vertices touch the floor, or none
    for below in (0.0, 1.0):
        floor = make_scene({"effect": "spring", "weight": 1e4}, mesh=GROUPS["spring"])
        low = float(floor.mesh.points[:, 1].min())
        floor = make_scene(
            {"effect": "spring", "weight": 1e4}, {"effect": "floor", "height": low - below},
            mesh=GROUPS["spring"],
        )  # fmt: skip
        standing = floor.mesh.points
        assert np.ptp(standing[:, 1]) > 0.1
        least, bound = ImplicitStep(floor, floor.initial_state(), 0).certify(standing)
        assert least > 0.0
        assert np.isnan(bound) == (below == 0.0)


def test_growth_is_the_norm_over_all_modes():
    def norm(m: float) -> float:
        root = np.sqrt(2.0)
        return float(np.linalg.norm([[m, m / root], [root * (m - 1.0), m]], 2))

    assert growth(1.0) == pytest.approx(np.sqrt(2.0))
    for least in (0.3, 2.0, -0.5):
        modes = np.linspace(0.0 if least > 0.0 else 1.0 / least, 1.0 / abs(least), 200)
        assert growth(least) == pytest.approx(max(map(norm, modes)), rel=1e-3)


def test_chained_residuals_are_no_less_than_the_error():
    scene = hanging("spring")
    run, exact = states(scene, Level(5)), states(scene, CONVERGED)
    steps = [ImplicitStep(scene, before, frame) for frame, before in enumerate(run[:-1])]
    ends = [state.positions for state in run[1:]]
    residuals = [step.residual(end) for step, end in zip(steps, ends, strict=True)]
    least = [step.certify(end)[0] for step, end in zip(steps, ends, strict=True)]
    error = ends[-1] - exact[-1].positions
    true = np.sqrt(np.sum(scene.system.inertia[:, None] * error**2))
    assert true < chained(0.0, residuals, least) < np.inf
