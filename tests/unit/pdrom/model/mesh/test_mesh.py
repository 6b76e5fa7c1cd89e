"""Meshes: generators, checks of cells and their orientation, the farthest points, files."""

from pathlib import Path

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import DegenerateElementError, MeshError
from pdrom.model.mesh.checks import check_mesh, merged, seams, turned_alike
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.selection import farthest_points, select_vertices
from pdrom.model.mesh.types import Mesh, load_mesh, save_mesh
from pdrom.model.runs import trajectory
from pdrom.model.scene import Scene, SceneConfig
from strategies import cells, wild_meshes
from study.experiments.hard_cases.catalogue import build


def test_cloth_has_the_counts_of_the_study():
    mesh = cloth(20, 20)
    assert (mesh.vertices, len(mesh.edges()), len(mesh.triangles)) == (400, 1121, 722)
    assert mesh.extent == pytest.approx(1.0)
    assert mesh.points.mean(axis=0) == pytest.approx([0.0, 2.0, 0.0])
    # cell (0, 0): ll, ur, ul and ll, lr, ur
    assert mesh.triangles[:2].tolist() == [[0, 21, 1], [0, 20, 21]]
    # triangles have the same orientation and tile the sheet
    mesh = cloth(5, 7)
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    assert (normal[:, 2] > 0).all()
    assert 0.5 * normal[:, 2].sum() == pytest.approx(1.0 * 4 / 6)


def test_bar_has_the_counts_of_the_study():
    mesh = bar(40, 5, 5)
    assert (mesh.vertices, len(mesh.tetrahedra)) == (1000, 3120)
    assert mesh.extent == pytest.approx(1.0)
    # it is conforming and fills its box
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


def test_a_mesh_is_read_as_it_was_written(tmp_path):
    mesh = bar(4, 3, 3)
    save_mesh(mesh, tmp_path / "mesh.h5")
    loaded = load_mesh(tmp_path / "mesh.h5")
    for name in ("points", "triangles", "tetrahedra"):
        assert np.array_equal(getattr(loaded, name), getattr(mesh, name))


def test_sides_of_a_sheet_and_farthest_points_that_start_at_the_centre():
    mesh = cloth(4, 3)
    for top, left in (("top", "left"), ("y_max", "x_min")):
        assert select_vertices(mesh, top).tolist() == [2, 5, 8, 11]
        assert select_vertices(mesh, left).tolist() == [0, 1, 2]
    assert select_vertices(mesh, [5, 1, 5]).tolist() == [1, 5]
    chosen = farthest_points(cloth(5, 5).points, np.arange(25), 5)
    assert chosen[0] == 12
    assert set(chosen[1:].tolist()) == {0, 4, 20, 24}


OPEN = cloth(4, 5).triangles
CLOSED = bar(3, 3, 4).triangles
BOTH = np.concatenate([OPEN, CLOSED + OPEN.max() + 1])


@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 0.4))
@pytest.mark.parametrize("triangles", [OPEN, CLOSED, BOTH], ids=["sheet", "closed", "two parts"])
def test_the_smaller_number_of_inconsistent_triangles_is_reversed(triangles, seed, share):
    rng = np.random.default_rng(seed)
    count = int(share * min(len(OPEN), len(CLOSED)))
    flipped = np.zeros(len(triangles), dtype=bool)
    flipped[rng.permutation(len(triangles))[:count]] = True
    given_so = np.where(flipped[:, None], triangles[:, ::-1], triangles)
    order = rng.permutation(len(triangles))
    alike, turned = turned_alike(Mesh(np.zeros((0, 3)), given_so[order]), "mesh")
    assert np.array_equal(turned, np.flatnonzero(flipped[order]))
    assert np.array_equal(alike.triangles, triangles[order])


def test_a_strip_with_one_side_is_refused():
    """Möbius' strip of six triangles: the ends of a strip are joined after half a turn."""
    strip = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4], [4, 5, 1], [5, 0, 1]])
    with pytest.raises(MeshError, match=r"strip: the surface around triangle 0 .* one side only"):
        turned_alike(Mesh(np.zeros((6, 3)), strip), "strip")
    assert 0 not in turned_alike(Mesh(np.zeros((6, 3)), strip[:-1]), "open strip")[1]


def one_cell(corners: np.ndarray) -> Mesh:
    indices = np.arange(len(corners), dtype=np.int32)[None]
    if len(corners) == 3:
        return Mesh(corners, indices)
    return Mesh(corners, np.empty((0, 3), dtype=np.int32), indices)


@given(corners=cells(3, 0.0) | cells(4, 0.0))
def test_cells_without_volume_are_refused(corners):
    """Collinear and coplanar up to rounding of the corners."""
    with pytest.raises(DegenerateElementError, match="has zero"):
        check_mesh(one_cell(corners), "mesh")


@given(sliver=cells(3, 1e-9) | cells(4, 1e-9), corners=cells(4, 0.5))
def test_slivers_and_cells_of_any_size_are_not_refused(sliver, corners):
    for taken in (sliver, 1e-100 * corners, 1e100 * corners):
        check_mesh(one_cell(taken), "mesh")


@given(data=st.data())
@pytest.mark.parametrize(
    ("shape", "effect"),
    [("sheet", "spring"), ("sheet", "strain"), ("sheet", "bending"), ("bar", "spring"),
     ("bar", "tetrahedron_strain"), ("bar", "deformation_gradient")],
)  # fmt: skip
def test_distorted_meshes_are_at_rest_in_their_rest_shape(shape, effect, data):
    """S at rest projects to itself: the elastic force vanishes for any mesh."""
    mesh = data.draw(wild_meshes(shape))
    scene = build(mesh, {"effect": effect, "weight": 1.0}, frames=1)
    group, points = scene.groups[0].for_run(), scene.mesh.points
    group.begin_frame(points)
    d = group.S @ points
    scale = np.abs(abs(group.S) @ np.abs(points)).max()
    assert np.abs(d - group.project(points)).max() <= 1e-12 * scale


SHEET, BAR = cloth(3, 3, "xz"), bar(3, 2, 2)


def read(folder: Path, points: np.ndarray, **cells: np.ndarray) -> Mesh:
    """The mesh of a file with these points and cells."""
    meshio.Mesh(points, list(cells.items())).write(folder / "mesh.vtu")
    return MeshFile(kind="file", path="mesh.vtu").build(folder)


def test_reversed_cells_are_reordered_and_reversed_triangles_are_reported(tmp_path, caplog):
    cells = BAR.tetrahedra.copy()
    cells[1] = cells[1][[1, 0, 2, 3]]
    corner = (mesh := read(tmp_path, BAR.points, tetra=cells)).points[mesh.tetrahedra]
    assert (np.linalg.det(corner[:, 1:] - corner[:, :1]) > 0.0).all()
    assert np.array_equal(np.sort(mesh.tetrahedra, axis=1), np.sort(BAR.tetrahedra, axis=1))
    cells = SHEET.triangles.copy()
    cells[2] = cells[2, ::-1]
    assert np.array_equal(read(tmp_path, SHEET.points, triangle=cells).triangles, SHEET.triangles)
    assert "1 of 8 triangles have the opposite orientation" in caplog.text


@pytest.mark.parametrize("joined", [False, True], ids=["two components", "joined in one vertex"])
@pytest.mark.parametrize("effect", ["spring", "strain", "bending"])
def test_a_mesh_of_separate_parts_is_accepted(tmp_path, joined, effect):
    """Without forces two sheets stay at rest; with a force on one, it moves."""
    other = SHEET.points + (1.0 if joined else 1.5) * np.array([1.0, 0.0, 1.0])
    # the last vertex of the first sheet may be the first of the second
    points = np.vstack([SHEET.points, other[joined:]])
    triangles = np.vstack([SHEET.triangles, SHEET.triangles + 9 - joined])
    mesh = read(tmp_path, points, triangle=triangles)
    entry = {"effect": effect, "weight": 10.0}
    settings = {"name": "parts", "title": "Parts", "mesh": {"kind": "file", "path": "mesh.vtu"}}
    for effects, still in (([entry], True), ([entry, {"effect": "gravity"}], False)):
        config = SceneConfig.model_validate({**settings, "frames": 4, "effects": effects})
        moved = trajectory(Scene.build(config, mesh))[-1] - mesh.points
        assert np.isfinite(moved).all()
        assert (np.abs(moved).max() < 1e-12) == still


def test_merging_keeps_the_first_of_close_vertices_and_leaves_flat_elements_out(caplog):
    copies = np.vstack([SHEET.points, SHEET.points[[0, 4]] + 1e-8])
    triangles = np.vstack([SHEET.triangles, [[0, 9, 4]]]).astype(np.int32)
    triangles[0][triangles[0] == 4] = 10
    mesh = merged(Mesh(copies, triangles), 1e-7, "mesh")
    assert np.array_equal(mesh.points, SHEET.points)
    assert np.array_equal(mesh.triangles, SHEET.triangles)
    assert "11 vertices are merged into 9; left out are 1 elements" in caplog.text
    assert seams(SHEET) == "1 connected part"
    assert MeshFile(kind="file", path="a.obj").model_dump() == {
        "kind": "file", "path": "a.obj", "scale": 1.0,
    }  # fmt: skip
