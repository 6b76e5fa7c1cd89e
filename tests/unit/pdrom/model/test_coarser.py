"""A scene on a coarser mesh: mass, prescribed motions, selections, errors, and the mesh error."""

from dataclasses import replace

import numpy as np
import pytest

from builders import GRAVITY, make_scene
from pdrom.core.errors import PdromError
from pdrom.model import coarser
from pdrom.model.dynamics.stepper import State
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.runs import trajectory

BAR = {"kind": "bar", "nx": 9, "ny": 5, "nz": 4}
BODY = {"effect": "deformation_gradient", "weight": 1e6}
SPRING = {"effect": "spring", "weight": 1e4}
MASSES = [{"density": 50.0}, {"select": "left", "density": 90.0}]


def solid(*effects: dict, **settings: object):
    return make_scene(GRAVITY, BODY, *effects, mesh=BAR, **settings)


def test_coarser_grids_keep_box_mass_and_centre_and_are_sorted_from_the_finest():
    scene = solid(masses=MASSES)
    made = coarser.grids(scene, (0.25, 0.5, 1.0, 2.0))
    assert [each.scene.mesh.vertices for each in made] == [5 * 3 * 3, 3 * 3 * 3]
    for each in made:
        own, mesh = each.scene, each.scene.mesh
        assert np.ptp(mesh.points, axis=0) == pytest.approx(np.ptp(scene.mesh.points, axis=0))
        assert own.masses.min() > 0.0
        assert own.masses.sum() == pytest.approx(scene.masses.sum())
        assert own.masses @ mesh.points == pytest.approx(scene.masses @ scene.mesh.points)
    given = scene.changed(mesh=coarser.GivenMesh.of(scene.mesh))
    assert coarser.grids(given, (0.5,)) == []


def test_affine_states_are_exact_on_the_coarse_mesh_and_back(rng):
    scene = solid()
    (made,) = coarser.grids(scene, (0.5,))
    slope, shift = rng.standard_normal((3, 3)), rng.standard_normal(3)
    at = scene.mesh.points @ slope + shift
    found = made.state(State(at, at))
    assert made.positions(found.positions) == pytest.approx(at)
    assert made.matrix @ found.velocities == pytest.approx(at)


def test_a_fixed_side_moves_as_on_the_fine_mesh():
    hold = {"effect": "translate", "select": "x_min", "offset": [0.1, 0.2, 0.0], "over": 5}
    scene = solid(hold, frames=6)
    (made,) = coarser.grids(scene, (0.5,))
    side = scene.boundaries[0].vertices
    runs = trajectory(scene), np.stack([made.positions(y) for y in trajectory(made.scene)])
    assert runs[0][-1] != pytest.approx(scene.mesh.points, abs=0.05)
    assert runs[1][:, side] == pytest.approx(runs[0][:, side])


@pytest.mark.parametrize("select", [[0, 5], {"kind": "complement", "of": [*range(1, 5)]}])
def test_vertices_selected_by_number_are_those_at_the_same_place(select):
    sheet = {"kind": "cloth", "rows": 6, "columns": 6, "plane": "xz"}
    scene = make_scene(SPRING, {"effect": "pins", "select": select}, mesh=sheet)
    (made,) = coarser.grids(scene, (0.6,))
    held = made.scene.mesh.points[made.scene.boundaries[0].vertices]
    apart = np.linalg.norm(held - scene.mesh.points[[0, 5], None], axis=2).min(axis=1)
    assert apart == pytest.approx(0.0, abs=1e-9)
    assert isinstance(select, dict) or len(held) == 2


SHORT = bar(5, 3, 3)
FLAT = replace(SHORT, tetrahedra=np.vstack([SHORT.tetrahedra, [[0, 1, 2, 2]]]))


@pytest.mark.parametrize(
    ("mesh", "fault"),
    [
        (bar(9, 5, 4), "has 180 vertices and tetrahedra; required are fewer than 180 vertices"),
        (cloth(5, 5), "25 vertices and triangles; required are fewer than 180 vertices and tetr"),
        (replace(SHORT, points=1e-3 * SHORT.points), "ends 2.* m from the scene's: check"),
        (bar(41, 2, 2), "no vertex of the scene's mesh is near its vertex"),
        (FLAT, "corner"),
    ],
    ids=["as fine", "surface", "millimetres", "finer along x", "degenerate"],
)
def test_a_mesh_that_is_not_coarser_is_refused(mesh, fault):
    with pytest.raises(PdromError, match=f"scene 'test': the coarser mesh.*{fault}"):
        coarser.on_mesh(solid(), mesh)


@pytest.mark.parametrize("order", [0.6, 2.9, 0.3, 3.5, -1.0, None])
def test_the_estimated_mesh_error_is_exact_for_powers_of_the_spacing(order, rng):
    """Orders .5 to 3 give an estimate; other orders, and a body at rest, give none."""
    moves, error = rng.standard_normal((2, 4, 10, 3))
    moves[0] = error[0] = 0.0
    spacings = [0.1, 0.17, 0.4]
    runs = [moves * 0.0 if order is None else moves + h**order * error for h in spacings]
    exact = None
    if order in (0.6, 2.9):
        exact = spacings[0] ** order * np.linalg.norm(error) / np.linalg.norm(runs[0])
    assert coarser.mesh_error(spacings, runs) == (exact and pytest.approx(exact))


def test_spacings_of_two_meshes_have_the_ratio_of_their_edges():
    for fine, coarse in ((bar(9, 9, 9), bar(5, 5, 5)), (cloth(9, 9), cloth(5, 5))):
        assert coarser.spacing(coarse) == pytest.approx(2.0 * coarser.spacing(fine))
