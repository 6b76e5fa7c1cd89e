"""The renderer: projection, depth order, shading; elements on the mesh; styles; residuals."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from pdrom.core.errors import ConfigurationError, StorageError
from pdrom.model.mesh.files import read_mesh_file
from pdrom.model.mesh.generators import bar, cloth
from pdrom.reduction.sampling.deim import block_elements, deim_entries
from pdrom.view import style
from pdrom.view.camera import Camera, Window, bounds, window_of
from pdrom.view.mesh_render import (
    AMBIENT,
    RASTER_ABOVE,
    Surface,
    depth_order,
    draw_floor,
    draw_surface,
    face_normals,
    outline_edges,
    shade,
    silhouette_edges,
)
from pdrom.view.panels import RunPanel, fit_aspect
from pdrom.view.read import choose_ranks, frame_numbers, positions_at, rerun_infos, rerun_positions
from places import CONFIG
from study.artifact.paths import RERUNS, TRAIN
from study.figures.kit.elements import element_map, magnitudes, signed_entry
from study.figures.sampling import iterations

from .conftest import BLOWN_UP, BLOWUP_FRAME

CAMERAS = [Camera(), Camera(0.0, 0.0), Camera(-120.0, 60.0), Camera(90.0, -30.0),
           Camera(up=(0.0, 0.0, 1.0))]  # fmt: skip


@pytest.mark.parametrize("camera", CAMERAS)
def test_camera_is_a_rotation_with_its_direction_up(camera):
    assert np.allclose(camera.basis @ camera.basis.T, np.eye(3))
    assert np.linalg.det(camera.basis) == pytest.approx(1.0)
    x, y = camera.project(np.array([camera.up]))[0]
    assert x == pytest.approx(0.0)
    assert y == pytest.approx(np.cos(np.radians(camera.elevation)))


def test_front_camera_sees_x_right_and_z_near():
    camera = Camera(0.0, 0.0)
    assert np.allclose(camera.project(np.array([[2.0, 3.0, 4.0]])), [[2.0, 3.0]])
    assert camera.depth(np.array([[2.0, 3.0, 4.0]]))[0] == pytest.approx(4.0)


@pytest.mark.parametrize("camera", CAMERAS)
def test_faces_are_painted_from_far_to_near(camera):
    mesh = bar(6, 3, 3)
    order = depth_order(mesh.points, mesh.triangles, camera)
    depth = camera.depth(mesh.points)[mesh.triangles].mean(axis=1)[order]
    assert sorted(order) == list(range(len(mesh.triangles)))
    assert (np.diff(depth) >= 0.0).all()


def test_nearest_face_covers_the_others():
    near, far = (
        np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]]),
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
    )
    points = np.concatenate([near, far]).astype(float)
    ax = Figure().subplots()
    colours = np.array([to_rgb("red"), to_rgb("blue")])
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    drawn = draw_surface(ax, points, Surface(triangles, False), Camera(0.0, 0.0), colours, wire=0.0)
    last = drawn.get_facecolors()[-1]
    assert last[0] > last[2]


@pytest.mark.parametrize("camera", CAMERAS)
def test_shading_is_bounded_and_two_sided(camera):
    normals = np.random.default_rng(0).standard_normal((500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    brightness = shade(normals, camera)
    assert brightness.min() >= AMBIENT
    assert brightness.max() <= 1.0
    assert np.ptp(brightness) > 0.3
    assert np.allclose(brightness, shade(-normals, camera))
    assert np.allclose(shade(np.zeros((1, 3)), camera), AMBIENT)


def test_normals_are_unit_or_zero():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [2, 0, 0]])
    normals = face_normals(points, np.array([[0, 1, 2], [0, 1, 3]]))
    assert np.allclose(normals, [[0, 0, 1], [0, 0, 0]])


def test_big_meshes_are_rasterised():
    small, big = cloth(5, 5), cloth(40, 40)
    assert len(big.triangles) > RASTER_ABOVE > len(small.triangles)
    for mesh, expected in ((small, False), (big, True)):
        ax = Figure().subplots()
        drawn = draw_surface(ax, mesh.points, Surface(mesh.triangles), Camera(), "grey")
        assert bool(drawn.get_rasterized()) is expected


def test_outline_of_sheet_and_bar():
    sheet, box = cloth(4, 5), bar(4, 3, 3)
    assert len(outline_edges(sheet.points, sheet.triangles)) == 2 * (3 + 4)
    # the twelve edges of the box, with 3 and twice 2 segments
    assert len(outline_edges(box.points, box.triangles)) == 4 * (3 + 2 + 2)


def test_the_silhouette_of_a_round_body_is_a_closed_line_around_it():
    ball = read_mesh_file(CONFIG / "scenes" / "meshes" / "ball.obj")
    points = ball.points - [0.0, 2.0, 0.0]
    assert len(outline_edges(points, ball.triangles)) == 0
    camera = Camera(30.0, 20.0)
    edges = silhouette_edges(points, ball.triangles, camera)
    assert (np.unique(edges, return_counts=True)[1] % 2 == 0).all()
    radii = np.linalg.norm(camera.project(points)[edges.ravel()], axis=1)
    assert radii.min() > 0.45


def test_floor_is_drawn_only_in_view():
    mesh, camera = cloth(4, 4, lift=2.0), Camera()
    for shift, expected in ((0.0, False), (-1.5, True)):
        points = mesh.points + np.array([0.0, shift, 0.0])
        window = window_of(camera, [points])
        ax = Figure().subplots()
        assert draw_floor(ax, points, Surface(mesh.triangles), camera, window) is expected


def test_windows():
    window = Window(0.0, 2.0, 0.0, 1.0)
    inside = window.contains(np.array([[1.0, 0.5], [3.0, 0.5]]))
    assert list(inside) == [True, False]
    assert bounds(np.array([[0.0, 0.0], [2.0, 1.0]]), 0.0) == window
    thin = fit_aspect(Window(0.0, 1.0, 0.0, 0.01))
    assert thin.height / thin.width == pytest.approx(0.35)
    tall = fit_aspect(Window(0.0, 0.1, 0.0, 1.0))
    assert tall.height / tall.width == pytest.approx(1.5)


def test_a_run_outside_is_seen_together_with_the_window():
    window = Window(-1.0, 1.0, -1.0, 1.0)
    inside = RunPanel("", "grey", np.zeros((1, 3))).seen_by(Camera())
    assert inside.zoomed(window) == window
    far = RunPanel("", "grey", np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])).seen_by(Camera(0, 0))
    larger = far.zoomed(window)
    assert larger.left <= -1.0
    assert larger.right >= 9.0
    assert far.scale(window) == pytest.approx(10.0 * 1.06 / 2.0)


@pytest.mark.parametrize(
    ("group", "mesh", "kind"),
    [
        ("bending", cloth(6, 5), "vertex"),
        ("spring", cloth(6, 5), "edge"),
        ("spring", bar(4, 3, 3), "edge"),
        ("strain", cloth(6, 5), "triangle"),
        ("deformation_gradient", bar(4, 3, 3), "tetrahedron"),
    ],
)
def test_elements_are_drawn_where_they_lie(group, mesh, kind):
    count = {"vertex": 4 * 3, "edge": len(mesh.edges()), "triangle": len(mesh.triangles),
             "tetrahedron": len(mesh.tetrahedra)}[kind]  # fmt: skip
    elements = element_map(group, mesh, count, "file")
    assert elements.kind == kind
    assert elements.centres(mesh.points).shape == (count, 3)
    ax = Figure().subplots()
    elements.draw(ax, mesh.points, np.linspace(0, 1, count), Camera(), magnitudes())
    assert ax.collections
    with pytest.raises(StorageError, match="the mesh has"):
        element_map(group, mesh, count + 1, "file")


def test_what_has_no_elements_cannot_be_drawn():
    with pytest.raises(ConfigurationError, match="unknown effect 'magic'"):
        element_map("magic", cloth(4, 4), 3, "file")
    with pytest.raises(StorageError, match="'gravity' has no elements"):
        element_map("gravity", cloth(4, 4), 3, "file")


def test_boundary_triangles_take_the_value_of_their_tetrahedron():
    mesh = bar(4, 3, 3)
    elements = element_map("tetrahedron_strain", mesh, len(mesh.tetrahedra), "file")
    owner = elements.face_values(np.arange(len(mesh.tetrahedra)))
    for triangle, tetrahedron in zip(mesh.triangles, owner, strict=True):
        assert set(triangle) < set(mesh.tetrahedra[tetrahedron])


def test_vertex_values_reach_the_faces_around():
    mesh = cloth(4, 4)
    elements = element_map("bending", mesh, 4, "file")
    values = elements.face_values(np.array([1.0, 1.0, 1.0, 1.0]))
    touched = np.isin(mesh.triangles, elements.cells[:, 0]).any(axis=1)
    assert np.allclose(values[touched], 1.0)
    assert np.isnan(values[~touched]).all()


def test_colours_and_markers_are_unique():
    for looks in (style.METHODS.values(), style.GROUP_LOOKS):
        for first, second in combinations(looks, 2):
            assert first[0] != second[0]
            assert first[1] != second[1]
    named = style.method_styles(["pod", "mine", "yours"])
    assert len(set(named.values())) == 3
    assert named["mine"] == style.method_styles(["yours", "mine"])["mine"]


def test_the_signed_entry_is_the_largest():
    vector = np.zeros((4, 6))
    vector[2, 4], vector[1, 0], vector[3, 4] = -3.0, 2.0, 1.0
    values, words = signed_entry(vector.ravel(), 2)
    assert values.tolist() == [0.0, 0.0, -3.0, 1.0]
    assert words == "y, row 2"
    assert signed_entry(vector.ravel(), 1)[1] == "y"


def test_residuals_are_those_of_deim():
    V = np.linalg.qr(np.random.default_rng(3).standard_normal((60, 6)))[0]
    entries = deim_entries(V)
    for step in iterations(V, entries, 2, "scalar", 6):
        coefficients = np.zeros(0)
        picked = entries[: step.k - 1]
        if len(picked):
            coefficients = np.linalg.solve(V[picked, : step.k - 1], V[picked, step.k - 1])
        residual = V[:, step.k - 1] - V[:, : step.k - 1] @ coefficients
        assert step.entry == np.argmax(np.abs(residual))
        assert np.allclose(step.magnitude, np.abs(residual.reshape(-1, 6)).max(axis=1))
        assert step.newest == step.entry // 6
        assert list(step.earlier) == [e // 6 for e in picked]


def test_residuals_of_blocks_and_joint_rows():
    V = np.linalg.qr(np.random.default_rng(4).standard_normal((60, 5)))[0]
    block = (6 * np.array([[2], [7], [1]]) + np.arange(6)).ravel()
    steps = iterations(V, block, 2, "element", 5)
    assert [step.newest for step in steps] == [2, 7, 1]
    joint = iterations(V, 3 * np.array([4, 11, 0]), 2, "joint", 5)
    assert [step.newest for step in joint] == [2, 5, 0]
    # row 4 was sampled on every axis: after the first step nothing is left there
    second = joint[1].magnitude[2]
    other = V.reshape(-1, 3, 5)[5]
    coefficient = V.reshape(-1, 3, 5)[4, :, 1] / V.reshape(-1, 3, 5)[4, :, 0]
    assert second == pytest.approx(np.linalg.norm(other[:, 1] - coefficient * other[:, 0]))


@pytest.mark.parametrize("rows", ["scalar", "element"])
def test_the_picked_element_is_the_darkest(rows):
    V = np.linalg.qr(np.random.default_rng(5).standard_normal((60, 6)))[0]
    blocks = (6 * block_elements(V, 6)[:, None] + np.arange(6)).ravel()
    entries = deim_entries(V) if rows == "scalar" else blocks
    for step in iterations(V, entries, 2, rows, 6):
        assert step.newest == np.argmax(step.magnitude)


def test_entries_outside_the_basis_are_refused():
    with pytest.raises(StorageError, match="do not fit"):
        iterations(np.eye(12)[:, :2], np.array([3, 12]), 2, "scalar", 2)


def test_instants_may_be_shares_of_the_first_frames(study):
    path = study.path(TRAIN, "spring_twist")
    frames, positions = positions_at(path, (0.5, 1.0), end=10)
    assert frames == [5, 10]
    whole, everything = positions_at(path, (0.25, 0.5, 1.0))
    assert whole == [5, 10, 20]
    assert (positions == everything[:2]).all()
    assert positions_at(path, (1.0,), end=99)[0] == [20]


def test_runs_are_read_only_where_finite(study):
    scene, method, r = BLOWN_UP
    path = study.path(RERUNS, scene, "spring", method)
    infos = {info.r: info for info in rerun_infos(path)}
    assert list(infos) == [6, 10, 14, 20]
    assert infos[14].full
    assert infos[20].marked
    entry, positions = rerun_positions(path, infos[r], 15)
    assert entry == BLOWUP_FRAME - 1
    assert np.isfinite(positions).all()
    assert rerun_positions(path, infos[20], 15) is None
    assert [i.r for i in choose_ranks(list(infos.values()), ("full", 14, 6, 99))] == [14, 6]
    assert choose_ranks(list(infos.values()), (99,)) == list(infos.values())


def test_instants_are_fractions_of_a_run():
    assert frame_numbers((0.0, 0.1, 0.11, 1.0), 20) == [0, 2, 20]
