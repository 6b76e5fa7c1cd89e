"""Files that meshio reads: whole ones exactly, and none of those that it would read wrong."""

from itertools import product
from pathlib import Path

import meshio
import numpy as np
import pytest

from mesh_files import read_here, refusal
from pdrom.model.mesh.generators import bar, cloth

# as in the reader's process
pytestmark = pytest.mark.filterwarnings("ignore")
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.5, 1.0]])
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
# meshio's writer, the extension, and what the writer is told
VARIANTS = [
    ("ansys", ".msh", {}), ("ansys", ".msh", {"binary": False}), ("avsucd", ".avs", {}),
    ("flac3d", ".f3grid", {}), ("flac3d", ".f3grid", {"binary": True}),
    ("gmsh", ".msh", {}), ("gmsh", ".msh", {"binary": False}), ("gmsh22", ".msh", {}),
    ("gmsh22", ".msh", {"binary": False}), ("medit", ".mesh", {}),
    ("medit", ".meshb", {}), ("nastran", ".nas", {}),
    ("nastran", ".bdf", {"point_format": "fixed-small"}), ("netgen", ".vol", {}),
    ("obj", ".obj", {}), ("off", ".off", {}), ("permas", ".dato", {}), ("ply", ".ply", {}),
    ("ply", ".ply", {"binary": False}), ("stl", ".stl", {}), ("stl", ".stl", {"binary": True}),
    ("su2", ".su2", {}), ("tecplot", ".tec", {}), ("ugrid", ".lb8.ugrid", {}),
    ("ugrid", ".b8l.ugrid", {}), ("ugrid", ".lr8.ugrid", {}), ("vtk", ".vtk", {}),
    ("vtk", ".vtk", {"binary": False}), ("vtk42", ".vtk", {}), ("vtk42", ".vtk", {"binary": False}),
    ("vtu", ".vtu", {}), ("vtu", ".vtu", {"binary": False}), ("vtu", ".vtu", {"compression": None}),
    ("wkt", ".wkt", {}),
]  # fmt: skip
# Nothing in these says how much there is: a cut between two lines of elements is not noticed here.
# The check of the mesh refuses what leaves a vertex without an element.
ENDLESS = (".obj", ".f3grid")
SURFACES = ("obj", "off", "ply", "stl", "wkt")
VOLUMES = ("su2", "flac3d")
CUTS = 25


def written(path: Path, writer: str, kind: str, more: dict) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a small mesh, which the file holds then, in a scrambled order."""
    mesh = cloth(4, 3, wave=0.25) if kind == "triangle" else bar(3, 2, 2)
    cells = mesh.triangles if kind == "triangle" else mesh.tetrahedra
    order = np.random.default_rng(2).permutation(mesh.vertices)
    points = np.empty_like(mesh.points)
    points[order] = mesh.points.round(3)  # some formats have few columns for digits
    meshio.write(path, meshio.Mesh(points, [(kind, order[cells])]), file_format=writer, **more)
    return points, order[cells]


@pytest.mark.parametrize(("writer", "suffix", "more"), VARIANTS)
@pytest.mark.parametrize("kind", ["triangle", "tetra"])
def test_what_is_written_is_read_and_what_is_cut_is_not(tmp_path, writer, suffix, more, kind):
    if (writer in SURFACES and kind == "tetra") or (writer in VOLUMES and kind == "triangle"):
        pytest.skip("not a kind that the format, or meshio's writer, knows")
    path = tmp_path / f"mesh{suffix}"
    points, cells = written(path, writer, kind, more)
    found, listed = read_here(path)
    if writer in ("stl", "wkt"):  # they hold no numbers, but the corners of each triangle
        assert np.array_equal(found[listed].astype(np.float32), points[cells].astype(np.float32))
    else:
        assert np.array_equal(found, points)
        assert np.array_equal(listed, cells)
    content = path.read_bytes()
    end = len(content.rstrip())
    cuts = np.random.default_rng(3).integers(0, end, CUTS)
    for cut in [*cuts, *range(end - CUTS, end)]:
        path.write_bytes(content[:cut])
        said = refusal(path)
        if not said:
            points, cells = read_here(path)
            assert np.array_equal(points, found), cut
            assert np.array_equal(cells, listed[: len(cells)]), cut
            assert len(cells) == len(listed) or suffix in ENDLESS, cut
        elif content[:cut].endswith(b"\n") and suffix in ENDLESS:
            continue
        else:
            assert said.startswith(("not a readable mesh (", "holds cells ")), said


# Of each format a whole file, a line of a vertex with its number, and one of a triangle.
BY_HAND = {
    ".nas": ("BEGIN BULK\n{}{}ENDDATA\n", "GRID,{},,{},{},{}\n", "CTRIA3,{},1,{},{},{}\n"),
    ".avs": ("4 2 0 0 0\n{}{}", "{} {} {} {}\n", "{} 1 tri {} {} {}\n"),
    ".dato": (
        "$COOR\n{}$ELEMENT TYPE=TRIA3\n{}$END STRUCTURE\n$FIN\n", "{} {} {} {}\n", "{} {} {} {}\n"
    ),
    ".f3grid": ("{}{}", "G {} {} {} {}\n", "F T3 {} {} {} {}\n"),
    ".msh": (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{}$EndNodes\n"
        "$Elements\n2\n{}$EndElements\n", "{} {} {} {}\n", "{} 2 2 0 1 {} {} {}\n"
    ),
    ".su2": (
        "NDIME= 3\nNELEM= 2\n{1}NPOIN= 4\n{0}NMARK= 0\n", "{1} {2} {3} {0}\n", "5 {1} {2} {3} {0}\n"
    ),
}  # fmt: skip


def text(suffix: str, numbers: list[int]) -> str:
    """A file of the format, by hand, in which the vertices have these numbers."""
    whole, vertex, triangle = BY_HAND[suffix]
    rows = zip(numbers, POINTS.tolist(), strict=True)
    corners = [[numbers[corner] for corner in row] for row in TRIANGLES]
    vertices = "".join(vertex.format(number, *point) for number, point in rows)
    triangles = "".join(triangle.format(place, *row) for place, row in enumerate(corners, 1))
    return whole.format(vertices, triangles)


NUMBERS = [[1, 2, 3, 4], [4, 2, 1, 3], [70, 8, 900, 15]]
NUMBERED = list(product([".nas", ".avs", ".dato", ".f3grid", ".msh"], NUMBERS))


@pytest.mark.parametrize(("suffix", "numbers"), [*NUMBERED, (".su2", [0, 1, 2, 3])])
def test_numbers_of_vertices_are_not_their_places(tmp_path, suffix, numbers):
    (tmp_path / f"a{suffix}").write_text(text(suffix, numbers))
    points, triangles = read_here(tmp_path / f"a{suffix}")
    assert np.array_equal(points, POINTS)
    assert triangles.tolist() == TRIANGLES


def test_su2_is_read_in_its_own_order_only(tmp_path):
    path = tmp_path / "a.su2"
    for numbers in ([1, 2, 3, 4], [3, 1, 0, 2]):
        path.write_text(text(".su2", numbers))
        assert "NPOIN: vertices are numbered in another order than 0, 1, 2" in refusal(path)


def replaced(suffix: str, old: str, new: str) -> str:
    """The file by hand, with every ``old`` replaced."""
    numbers = [0, 1, 2, 3] if suffix == ".su2" else [1, 2, 3, 4]
    whole = text(suffix, numbers)
    assert old in whole
    return whole.replace(old, new)


TECPLOT = (
    'VARIABLES = "X", "Y", "Z"\nZONE NODES=3, ELEMENTS=1, DATAPACKING=POINT, ZONETYPE=FETRIANGLE\n'
    "0 0 0\n1 0 0\n0 1 0\n1 2 3\n"
)


@pytest.mark.parametrize(
    ("suffix", "content", "why"),
    [
        (".nas", replaced(".nas", "GRID,2,,", "GRID,2,5,"), "GRID with a coordinate system (CP)"),
        (".nas", replaced(".nas", "ENDDATA", "GRDSET,,5\nENDDATA"), "GRDSET: no other coordinate"),
        (".nas", replaced(".nas", "ENDDATA", "include 'b'\nENDDATA"), "include: no other"),
        (".nas", replaced(".nas", "CTRIA3,2", "CTRIA3*,2"), "CTRIA3*: no other"),
        (".nas", replaced(".nas", "ENDDATA", ""), "cut off"),
        (".tec", TECPLOT + TECPLOT.split("\n", 1)[1], "ZONE: one zone is read"),
        (".dat", TECPLOT[:-3], "cut off"),
        (".su2", replaced(".su2", "NDIME", "NZONE= 2\nNDIME"), "NZONE= 2: one zone is read"),
        (".su2", replaced(".su2", "NELEM= 2", "NELEM= 5"), "not a readable mesh"),
        (".msh", replaced(".msh", "$EndElements\n", ""), "cut off"),
        (".wkt", "TIN (((0 0 0, 1 0 0, 1 1 0, 0 0 0)), ((0 0 0)", "brackets that are not closed"),
        (".stl", "solid\n" + "facet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "does not end as"),
        (".stl", bytes(80) + b"\2\0\0\0" + bytes(50), "does not end as"),
        (".vtu", "<VTKFile>", "does not end as"),
    ],
)  # fmt: skip
def test_what_meshio_would_read_wrong_is_refused(tmp_path, suffix, content, why):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    assert why in refusal(path)


def test_text_is_read_in_double_precision(tmp_path):
    (tmp_path / "a.ugrid").write_text("3 1 0 0 0 0 0\n0.1 0 0\n1 0 0\n0 1 0\n1 2 3\n1\n")
    assert read_here(tmp_path / "a.ugrid")[0][0, 0] == 0.1


def test_nothing_stays_replaced(tmp_path):
    opened, fromfile = open, np.fromfile
    path = tmp_path / "a.msh"
    path.write_text(text(".msh", [1, 2, 3, 4])[:120])
    assert "cut off" in refusal(path)
    assert (opened, fromfile) == (open, np.fromfile)
