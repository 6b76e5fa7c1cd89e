"""Generators, checks and selections."""

import numpy as np
import pytest

from pdrom.core.errors import SceneError
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.select import farthest_points, select_vertices
from pdrom.model.mesh.types import load_mesh, save_mesh


def test_cloth_has_the_counts_of_the_study():
    mesh = cloth(20, 20)
    assert (mesh.vertices, len(mesh.edges()), len(mesh.triangles)) == (400, 1121, 722)
    assert mesh.extent == pytest.approx(1.0)
    assert mesh.points.mean(axis=0) == pytest.approx([0.0, 2.0, 0.0])
    # cell (0, 0): ll, ur, ul and ll, lr, ur
    assert mesh.triangles[:2].tolist() == [[0, 21, 1], [0, 20, 21]]


def test_cloth_triangles_face_one_way_and_tile_the_sheet():
    mesh = cloth(5, 7)
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    assert (normal[:, 2] > 0).all()
    assert 0.5 * normal[:, 2].sum() == pytest.approx(1.0 * 4 / 6)


def test_bar_has_the_counts_of_the_study():
    mesh = bar(40, 5, 5)
    assert (mesh.vertices, len(mesh.tetrahedra)) == (1000, 3120)
    assert mesh.extent == pytest.approx(1.0)


def test_bar_is_conforming_and_fills_its_box():
    mesh = bar(4, 3, 5)
    corner = mesh.points[mesh.tetrahedra]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6.0
    assert (volume > 0).all()
    assert volume.sum() == pytest.approx(np.ptp(mesh.points, axis=0).prod())
    # closed boundary: every edge belongs to exactly two boundary triangles; outward: same volume
    edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(volume.sum())


def test_round_trip(tmp_path):
    mesh = bar(4, 3, 3)
    save_mesh(mesh, tmp_path / "mesh.h5")
    loaded = load_mesh(tmp_path / "mesh.h5")
    for name in ("points", "triangles", "tetrahedra"):
        assert np.array_equal(getattr(loaded, name), getattr(mesh, name))


def test_sides_of_a_sheet():
    mesh = cloth(4, 3)
    assert select_vertices(mesh, "top").tolist() == [2, 5, 8, 11]
    assert select_vertices(mesh, "left").tolist() == [0, 1, 2]
    assert select_vertices(mesh, [5, 1, 5]).tolist() == [1, 5]


@pytest.mark.parametrize(
    ("selection", "message"),
    [("front", "flat along"), ("up", "allowed are"), ([], "no vertex"), ([99], "0 to 11")],
)
def test_empty_selections_are_refused(selection, message):
    with pytest.raises(SceneError, match=message):
        select_vertices(cloth(4, 3), selection)


def test_farthest_points_start_at_the_centre_and_spread():
    mesh = cloth(5, 5)
    chosen = farthest_points(mesh.points, np.arange(25), 5)
    assert chosen[0] == 12
    assert set(chosen[1:].tolist()) == {0, 4, 20, 24}
