"""Drag and wind: exact where a solution is known, and never more energy relative to the air."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from builders import make_scene
from strategies import SEEDS

SPRING = {"effect": "spring", "weight": 1.0}
H = 0.016


def kicked(scene, positions, velocities):
    """Velocities after the forces of one frame alone."""
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
    # a sheet edge on feels none
    scene = make_scene(SPRING, {"effect": "wind", "velocity": [300, 100, 0]})
    rest = np.zeros_like(scene.mesh.points)
    assert np.array_equal(kicked(scene, scene.mesh.points, rest), rest)


def test_drag_has_no_say_inside_a_volume():
    bar = {"kind": "bar", "nx": 4, "ny": 4, "nz": 4}
    spring = {"effect": "tetrahedron_strain", "weight": 1.0}
    scene = make_scene(spring, {"effect": "drag", "coefficient": 1e6}, mesh=bar)
    v = np.ones_like(scene.mesh.points)
    inside = np.setdiff1d(np.arange(scene.mesh.vertices), scene.mesh.triangles)
    assert len(inside) == 8
    assert np.array_equal(np.flatnonzero((kicked(scene, scene.mesh.points, v) == v).all(1)), inside)


@given(seed=SEEDS, speed=st.floats(0.0, 6.0), mass=st.floats(-6.0, 3.0), effect=st.booleans())
def test_energy_relative_to_the_air_never_grows(seed, speed, mass, effect):
    """For any wind up to 1e6 m/s, any state, light and heavy vertices."""
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
