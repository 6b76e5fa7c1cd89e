"""The renderer: projection, depth order, shading, outlines, windows."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from pdrom.model.mesh.files import read_mesh_file
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.types import Mesh
from pdrom.view import mesh_render
from pdrom.view.camera import Camera, Window, bounds, window_of
from pdrom.view.panels import RunPanel, fit_aspect
from places import CONFIG

CAMERAS = [Camera(), Camera(0.0, 0.0), Camera(-120.0, 60.0), Camera(90.0, -30.0),
           Camera(up=(0.0, 0.0, 1.0))]  # fmt: skip


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_camera_is_a_rotation_with_the_given_direction_up(camera):
    assert np.allclose(camera.basis @ camera.basis.T, np.eye(3))
    assert np.linalg.det(camera.basis) == pytest.approx(1.0)
    up = [0.0, np.cos(np.radians(camera.elevation))]
    assert camera.project(np.array([camera.up]))[0] == pytest.approx(up)


def test_front_camera_sees_x_right_and_z_near():
    camera, point = Camera(0.0, 0.0), np.array([[2.0, 3.0, 4.0]])
    assert np.allclose(camera.project(point), [[2.0, 3.0]])
    assert camera.depth(point)[0] == pytest.approx(4.0)


def test_the_nearest_face_covers_the_others():
    corners = [[0, 0], [1, 0], [0, 1]]
    points = np.array([[x, y, z] for z in (1, 0) for x, y in corners], dtype=float)
    mesh, colours = Mesh(points, np.arange(6).reshape(2, 3)), np.array([to_rgb("r"), to_rgb("b")])
    ax = Figure().subplots()
    drawn = mesh_render.draw_surface(ax, points, mesh, Camera(0.0, 0.0), colours, wire=0.0)
    last = drawn.get_facecolors()[-1]
    assert last[0] > last[2]


@pytest.mark.parametrize("camera", CAMERAS)
def test_shading_is_bounded_and_two_sided(camera):
    normals = np.random.default_rng(0).standard_normal((500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    brightness = mesh_render.shade(normals, camera)
    assert brightness.min() >= mesh_render.AMBIENT
    assert brightness.max() <= 1.0
    assert np.ptp(brightness) > 0.3
    assert np.allclose(brightness, mesh_render.shade(-normals, camera))
    assert np.allclose(mesh_render.shade(np.zeros((1, 3)), camera), mesh_render.AMBIENT)


def test_normals_are_unit_or_zero():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [2, 0, 0]])
    normals = mesh_render.face_normals(points, np.array([[0, 1, 2], [0, 1, 3]]))
    assert np.allclose(normals, [[0, 0, 1], [0, 0, 0]])


def test_the_outlines_of_a_sheet_and_a_bar_are_their_edges():
    """At any position; a box has its twelve edges, with 3 and twice 2 segments."""
    for mesh, count in ((cloth(4, 5), 2 * (3 + 4)), (bar(4, 3, 3), 4 * (3 + 2 + 2))):
        here = np.random.default_rng(0).standard_normal(mesh.points.shape)
        found = mesh_render.outline_edges(mesh.points, here, mesh.triangles, Camera())
        assert len(found) == count


def test_the_silhouette_of_a_round_body_is_a_closed_line_around_it():
    ball = read_mesh_file(CONFIG / "scenes" / "meshes" / "ball.obj")
    points = ball.points - [0.0, 2.0, 0.0]
    camera = Camera(30.0, 20.0)
    edges = mesh_render.outline_edges(points, points, ball.triangles, camera)
    assert (np.unique(edges, return_counts=True)[1] % 2 == 0).all()
    radii = np.linalg.norm(camera.project(points)[edges.ravel()], axis=1)
    assert radii.min() > 0.45


@pytest.mark.parametrize(("shift", "drawn"), [(0.0, 0), (-1.5, 2)])
def test_a_floor_is_drawn_only_in_view(shift, drawn):
    mesh, camera, ax = cloth(4, 4, lift=2.0), Camera(), Figure().subplots()
    points = mesh.points + np.array([0.0, shift, 0.0])
    mesh_render.draw_floor(ax, points, mesh, camera, window_of(camera, [points]))
    assert len(ax.collections) == drawn


def test_a_window_contains_its_points_and_keeps_a_bounded_aspect():
    window = Window(0.0, 2.0, 0.0, 1.0)
    assert list(window.contains(np.array([[1.0, 0.5], [3.0, 0.5]]))) == [True, False]
    assert bounds(np.array([[0.0, 0.0], [2.0, 1.0]]), 0.0) == window
    for shape, allowed in (((1.0, 0.01), 0.35), ((0.1, 1.0), 1.5)):
        fitted = fit_aspect(window.resized(*shape))
        assert fitted.height / fitted.width == pytest.approx(allowed)


def test_a_run_outside_is_seen_together_with_the_window():
    window, camera = Window(-1.0, 1.0, -1.0, 1.0), Camera(0.0, 0.0)
    inside = RunPanel("", "grey", np.zeros((1, 3)))
    assert inside.zoomed(window, camera) == window
    far = RunPanel("", "grey", np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]]))
    larger = far.zoomed(window, camera)
    assert larger.left <= -1.0
    assert larger.right >= 9.0
    assert larger.width / window.width == pytest.approx(10.0 * 1.06 / 2.0)
