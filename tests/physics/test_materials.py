"""Stretched bars and strips of a material, and the weight of bending, against closed formulas."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from builders import LEFT, make_scene
from pdrom.api import build_scene
from pdrom.model.dynamics.stepper import State

SOLID = {"effect": "deformation_gradient", "young": 1e6}
SHEET = {"effect": "strain", "young": 1e6, "thickness": 2e-3}
BAR = {"kind": "bar", "nx": 13, "ny": 4, "nz": 4, "lift": 0.0}
STRIP = {"kind": "cloth", "rows": 13, "columns": 4, "lift": 0.0}
PULL = {"effect": "translate", "select": "x_max", "over": 1, "offset": [1e-3, 0.0, 0.0]}
STATIC = {"time_step": 1.0, "vertex_mass": 1e-3}


def largest_error(mesh: dict, group: dict, iterations: int) -> float:
    """Relative error of E and nu in the middle third of a body stretched by 0.1 %."""
    scene = make_scene(LEFT, PULL, group, mesh=mesh, iterations=iterations, **STATIC)
    nu = group["poisson"]
    x, y = scene.mesh.points, scene.stepper().step(scene.initial_state(), 0)[0].positions
    middle, (_, width, height) = np.abs(x[:, 0]) <= 1.0 / 6.0 + 1e-9, np.ptp(x, axis=0)
    strain, *lateral = np.diag(np.linalg.lstsq(x[middle], (y - x)[middle])[0])[: 3 if height else 2]
    force = sum(g.S.T @ (g.row_weights[:, None] * (g.S @ y - g.project(y))) for g in scene.groups)
    stress = force[x[:, 0] > 0.03, 0].sum() / (width * (height or 2e-3))
    return max(abs(stress / (1e6 * strain) - 1.0), *np.abs(lateral / strain + nu) / (nu or 1.0))


@pytest.mark.parametrize(
    ("group", "mesh", "nu", "iterations"),
    [(SOLID, BAR, 0.0, 1), (SOLID, BAR, 0.3, 10), (SOLID, BAR, 0.45, 29),
     (SHEET, STRIP, 0.0, 1), (SHEET, STRIP, 0.3, 7), (SHEET, STRIP, 0.45, 8)],
)  # fmt: skip
def test_stretched_bodies_have_their_material_constants_to_1_percent(group, mesh, nu, iterations):
    group = group | {"poisson": nu}
    assert largest_error(mesh, group, iterations) < 0.01
    assert iterations == 1 or largest_error(mesh, group, iterations - 1) > 0.01
    assert largest_error(mesh, group, 400) < 0.003


@pytest.mark.parametrize(("group", "mesh", "dimension"), [(SOLID, BAR, 3), (SHEET, STRIP, 2)])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45, 0.49])
def test_an_iteration_leaves_d_nu_over_1_plus_nu_of_an_isochoric_strain(group, mesh, dimension, nu):
    scene = make_scene(group | {"poisson": nu}, mesh=mesh, iterations=1, **STATIC)
    start = State(scene.mesh.points * [1.0 + 1e-5, 1.0 - 1e-5, 1.0], 0.0 * scene.mesh.points)
    left = np.ptp(scene.stepper().step(start, 0)[0].positions[:, 0]) - 1.0
    assert left / 1e-5 == pytest.approx(dimension * nu / (1.0 + nu), rel=2e-3, abs=1e-4)


def square(side: int, shaken: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangulated unit square; its inner vertices are moved by up to ``shaken`` spacings."""
    points = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, side)] * 2), axis=2)
    inner = points[1:-1, 1:-1]
    inner += np.random.default_rng(0).uniform(-shaken, shaken, inner.shape) / (side - 1)
    return np.insert(points.reshape(-1, 2), 1, 0, axis=1), Delaunay(points.reshape(-1, 2)).simplices


@pytest.mark.parametrize(("side", "shaken"), [(11, 0.0), (21, 0.0), (41, 0.0), (21, 0.25)])
def test_bending_has_the_rigidity_of_a_plate_only_if_the_boundary_is_fixed(side, shaken):
    """Vertices of a free edge can move without bending energy, so no stiffness in N m results."""
    held = {"effect": "pins", "select": {"kind": "boundary_loop", "index": 0}}
    pull = {"effect": "gravity", "acceleration": [0.0, -1.0, 0.0]}
    scene = build_scene(
        mesh=square(side, shaken), frames=1, time_step=10.0, iterations=1,
        masses=[{"density": 1.0}], effects=[held, pull, {"effect": "bending", "weight": 50.0}],
    )  # fmt: skip
    after, _ = scene.stepper().step(scene.initial_state(), 0)
    assert 50.0 * np.abs(after.positions[:, 1]).max() == pytest.approx(0.0040624, rel=0.01)
    (group,), free = scene.groups, np.flatnonzero(scene.mesh.points[:, 0] > 0.12)  # one side fixed
    energies = np.linalg.eigvalsh(group.system_matrix().toarray()[np.ix_(free, free)])
    assert np.sum(energies < 1e-9 * energies.max()) > 0.7 * len(np.setdiff1d(free, group.vertices))
