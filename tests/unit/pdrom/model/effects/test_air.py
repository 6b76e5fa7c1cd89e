"""Drag and wind: known solutions are exact, energy never grows, keyframes are reached."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from builders import make_scene
from pdrom.model.runs import trajectory
from strategies import SEEDS

SPRING = {"effect": "spring", "weight": 1.0}
H = 0.016


def kicked(scene, positions, velocities):
    """Velocities after only the forces of one frame."""
    (force,) = scene.forces
    return velocities + scene.config.time_step * force.acceleration(positions, velocities)


def test_drag_is_the_exact_decay_of_each_vertex(rng):
    """dv/dt = -c A_v / m v: corners of the sheet have less area and slow down less."""
    scene = make_scene(SPRING, {"effect": "drag", "coefficient": 1e5})
    v = rng.standard_normal(scene.mesh.points.shape)
    after = kicked(scene, scene.mesh.points, v)
    areas = np.zeros(scene.mesh.vertices)
    for triangle in scene.mesh.triangles:
        a, b, c = scene.mesh.points[triangle]
        areas[triangle] += np.linalg.norm(np.cross(b - a, c - a)) / 6.0
    assert after == pytest.approx(v * np.exp(-1e5 * areas * H / 10.0)[:, None])


def test_wind_accelerates_a_flat_sheet_as_the_differential_equation_does():
    """dv/dt = k (u - v)^2 has the solution u - v = u / (1 + k u t), k = rho C A / (2 m).

    A sheet broadside to the wind, whose vertices all have the mass of their area.
    """
    scene = make_scene(
        SPRING,
        {"effect": "wind", "velocity": [0, 0, 40], "density": 2.0, "coefficient": 1.5},
        mesh={"kind": "cloth", "rows": 4, "columns": 4},
        masses=[{"density": 0.3}],
    )
    v = np.zeros_like(scene.mesh.points)
    for _ in range(5):
        v = kicked(scene, scene.mesh.points, v)
    expected = 40.0 - 40.0 / (1.0 + (1.5 / 0.3) * 40.0 * 5 * H)
    assert v == pytest.approx(np.tile([0.0, 0.0, expected], (16, 1)))
    # a sheet parallel to the wind has no force
    scene = make_scene(SPRING, {"effect": "wind", "velocity": [300, 100, 0]})
    rest = np.zeros_like(scene.mesh.points)
    assert np.array_equal(kicked(scene, scene.mesh.points, rest), rest)


@given(seed=SEEDS, speed=st.floats(0.0, 6.0), mass=st.floats(-6.0, 3.0), effect=st.booleans())
def test_energy_relative_to_the_air_never_grows(seed, speed, mass, effect):
    """For winds up to 1e6 m/s, random states, and light and heavy vertices."""
    rng = np.random.default_rng(seed)
    wind = 10.0**speed * rng.uniform(-1.0, 1.0, 3) if effect else np.zeros(3)
    air = (
        {"effect": "wind", "velocity": tuple(wind)}
        if effect
        else {"effect": "drag", "coefficient": 10.0**speed}
    )
    scene = make_scene(SPRING, air, vertex_mass=10.0**mass)
    q = rng.standard_normal(scene.mesh.points.shape)
    v = rng.standard_normal(q.shape) * 10.0 ** rng.uniform(-2, 5)
    before, after = (np.sum((u - wind) ** 2) for u in (v, kicked(scene, q, v)))
    assert after <= before * (1 + 1e-12)


KEYS = [
    {"at": 4, "offset": [0.1, 0.2, 0.0]},
    {"at": 10, "offset": [0.1, 0.0, 0.3], "turn": [0, 90, 0]},
    {"at": 12, "offset": [0.0, 0.0, 0.3], "turn": [0, 450, 0]},
]


def handle(**changes):
    effect = {"effect": "keyframes", "select": "top", "keys": KEYS, **changes}
    return make_scene({"effect": "spring", "weight": 1e4}, effect, frames=20)


def posed(points, offset, turn=(0, 0, 0)):
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle + Rotation.from_rotvec(turn, degrees=True).apply(points - middle) + offset


@pytest.mark.parametrize("interpolation", ["linear", "smooth"])
@pytest.mark.parametrize("start", [0, 3])
def test_the_wind_has_the_value_of_every_keyframe(interpolation, start):
    scene = handle(interpolation=interpolation, start=start)
    run = trajectory(scene)
    held = scene.boundaries[0].vertices
    taken = run[start, held]
    for key in KEYS:
        expected = posed(taken, key["offset"], key.get("turn", (0, 0, 0)))
        assert run[start + key["at"], held] == pytest.approx(expected, abs=1e-12)
    # a turn by 450 degrees ends as one by 90, but the way there differs
    assert run[-1, held] == pytest.approx(posed(taken, [0, 0, 0.3], [0, 90, 0]), abs=1e-12)
    if interpolation == "linear":
        halfway = posed(taken, [0.05, 0, 0.3], [0, 270, 0])
        assert run[start + 11, held] == pytest.approx(halfway, abs=1e-12)


def test_smooth_keyframes_have_no_kink_and_no_overshoot():
    keys = [{"at": 10, "offset": [0, 1, 0]}, {"at": 20, "offset": [0, 1, 0]}]
    scene = handle(keys=keys, interpolation="smooth")
    (boundary,) = scene.boundaries
    start = scene.mesh.points[boundary.vertices]
    path = np.array([boundary.targets(f, start)[0, 1] - start[0, 1] for f in range(20)])
    assert (np.diff(path) >= 0.0).all()
    assert path.max() <= 1.0
    assert np.abs(np.diff(path, 2)).max() < 0.04  # linear: 0.1
