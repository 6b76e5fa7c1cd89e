"""Generators, checks and selections."""

import numpy as np
import pytest

from pdrom.core.errors import DegenerateElementError, MeshError, SceneError, StorageError
from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.select import farthest_points, select_vertices
from pdrom.model.mesh.types import Mesh, load_mesh, save_mesh


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


def test_truncated_file_is_named(tmp_path):
    path = tmp_path / "mesh.h5"
    save_mesh(bar(4, 3, 3), path)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(StorageError, match=r"mesh\.h5"):
        load_mesh(path)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
CELLS = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def _changed(index, value):
    points = SQUARE.copy()
    points[index] = value
    return points


@pytest.mark.parametrize(
    ("points", "cells", "error", "message"),
    [
        (_changed((1, 0), np.nan), CELLS, MeshError, r"entry \(1, 0\) is nan"),
        (_changed((1, 0), np.inf), CELLS, MeshError, r"entry \(1, 0\) is inf"),
        (np.vstack([SQUARE, [5, 5, 5]]), CELLS, MeshError, "1 vertices in no element"),
        (np.vstack([SQUARE, SQUARE[:1]]), np.vstack([CELLS, [4, 1, 3]]), MeshError, "repeats"),
        (SQUARE, np.array([[0, 1, 2], [0, 2, 7]]), MeshError, "allowed: 0 to 3"),
        (SQUARE, np.array([[0, 1, 2], [0, 3, 3]]), DegenerateElementError, "twice"),
        (_changed(2, [2, 0, 0]), CELLS[:, :], DegenerateElementError, "zero area"),
        (SQUARE, np.empty((0, 3), dtype=np.int32), MeshError, "no triangles"),
        (SQUARE, np.vstack([CELLS, [2, 0, 1]]), MeshError, r"2 \[2, 0, 1\] repeats triangle 0"),
        (SQUARE, np.vstack([CELLS, [1, 0, 2]]), MeshError, r"2 \[1, 0, 2\] repeats triangle 0"),
    ],
)
def test_faults_are_named(points, cells, error, message):
    with pytest.raises(error, match=message):
        check_mesh(Mesh(points, cells), "square")


def test_flat_tetrahedron_is_named():
    with pytest.raises(DegenerateElementError, match="zero volume"):
        check_mesh(Mesh(SQUARE, CELLS, np.array([[0, 1, 2, 3]], dtype=np.int32)), "flat")


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
