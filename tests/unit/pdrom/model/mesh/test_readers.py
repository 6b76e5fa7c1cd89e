"""Ordinary mesh files, as programs write them: their points and cells exactly, or a line."""

from pathlib import Path

import numpy as np
import pytest

from mesh_files import read_here, refusal

# as in the reader's process
pytestmark = pytest.mark.filterwarnings("ignore")
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 0.25, 1.0], [0.0, 0.5, 1e-3]])
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
V = "v 0 0 0\nv 1 0 0.1\nv 1 .25 1\nv 0 0.5 1e-3\n"
XYZ = "0 0 0\n1 0 0.1\n1 .25 1\n0 0.5 1e-3\n"
FACES = "3 0 1 2\n3 0 2 3\n"
PLAIN = "plain form is read: save it as .vtu, .msh or .obj"


def square(path: Path, content: str | bytes) -> None:
    """The file holds the square."""
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    points, triangles = read_here(path)
    assert points.dtype == np.float64
    assert np.array_equal(points, POINTS)
    assert triangles.tolist() == TRIANGLES


@pytest.mark.parametrize(
    "content",
    [
        V + "f 1 2 3\nf 1 3 4\n",
        V + "f 1 2 3\nf 1 3 4",
        "# head\nmtllib a.mtl\no sheet\n" + V + "vt 0 0\nvt 1 1\nvn 0 1 0\ng top\nusemtl red\n"
        "s off\nf 1/1/1 2/2/1 3/1/1\nf 1//1 3//1 4//1\nl 1 2\np 3\n",
        V + "vt 0 0\n" * 9 + "f 1/9 2/8 3/7\nf 1/1 3/2 4/3\n",
        V + "f -4 -3 -2\nf -4 -2 -1\n",
        "v 0 0 0\nv 1 0 0.1\nv 1 .25 1\nf -3 -2 -1\nv 0 0.5 1e-3\nf -4 -2 -1\n",
        V.replace("\n", " 1.0\n") + "f 1 2 3\nf 1 3 4\n",
        V.replace("\n", " 0.2 0.4 0.6\n") + "f 1 2 3\nf 1 3 4\n",
        V + "# C:\\meshes\\\nf 1 2 3 # one \\\nf 1 3 4\n",
        V + "f 1 \\\n2 3\nf 1 3 \\  \r\n4\n",
        V.replace(" ", "\t").replace("\n", "\r\n") + "\r\n  f 1 2  3 # one\r\nf\t1 3 4\r\n",
        (V + "f 1 2 3 # one\n# lower part\nf 1 3 \\\n4\n").replace("\n", "\r"),
        (V + "g H\u00fclle\nf 1 2 3\nfo 1 3 4\n").encode("latin-1"),
    ],
)
def test_obj(tmp_path, content):
    square(tmp_path / "a.obj", content)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (V + "f 1 2 3\nf 1 3 4\ncall b.obj\n", "statement 'call' is not read"),
        (V + "f 1 2 3\nsurf 0 1 0 1 1 2 3\n", "statement 'surf'"),
        (V + "f 1 2 3\nf 1 3 4.5\n", "corners that are no whole numbers"),
        (V + "f 1 2 3\nf 1 3\n", "['polygon', 'triangle']|['triangle', 'polygon']"),
        (V.replace("v 1 .25 1", "v 1 .25") + "f 1 2 3\nf 1 3 4\n", "not a readable mesh (vertices"),
        (V * 5 + "f 1 2 3\nf 1 3 2", "cut off: .* go on after 2"),
        (V + "f 1 2 3\nf 1 3", "cut off"),
        ("f -3 -2 -1\nv 0 0 0\nv 1 0 0\nv 1 0 1.5", "cut off: .* go on after 1.5"),
    ],
)
def test_faulty_obj(tmp_path, content, why):
    (tmp_path / "a.obj").write_text(content)
    found = refusal(tmp_path / "a.obj")
    assert any(all(word in found for word in part.split(" .* ")) for part in why.split("|")), found


def ply(face: str = "", rows: str = FACES, order: str = "ascii", of: str = "double") -> str:
    """A file with these properties of its faces behind their corners, and with their rows."""
    axes = "".join(f"property {of} {axis}\n" for axis in "xyz")
    return (
        f"ply\nformat {order} 1.0\ncomment made here\nelement vertex 4\n{axes}property uchar red\n"
        f"element face 2\nproperty list uchar int vertex_indices\n{face}end_header\n"
        + (XYZ.replace("\n", " 255\n") + rows if order == "ascii" else "")
    )


def binary_ply(face: str = "", after: int = 0) -> bytes:
    """The same in binary, with some bytes behind the corners of each face."""
    vertices = np.zeros(4, [("at", "<f8", 3), ("red", "u1")])
    vertices["at"] = POINTS
    faces = np.zeros(2, [("n", "u1"), ("corners", "<i4", 3), ("more", f"V{after}")])
    faces["n"], faces["corners"] = 3, TRIANGLES
    head = ply(face, order="binary_little_endian")
    return head.encode() + vertices.tobytes() + faces.tobytes()


def faces_first() -> str:
    """A file of whose lines meshio would take the first for vertices."""
    head, _, rows = ply().partition("end_header\n")
    vertex = head[head.index("element vertex") : head.index("element face")]
    return head.replace(vertex, "") + vertex + "end_header\n" + rows


def legacy(dataset: str, sections: str, version: str = "3.0") -> str:
    return (
        f"# vtk DataFile Version {version}\nsheet\nASCII\nDATASET {dataset}\n"
        f"POINTS 4 double\n{XYZ}{sections}"
    )


GRID = f"CELLS 2 8\n{FACES}CELL_TYPES 2\n5\n5\n"
OFFSETS = "OFFSETS vtktypeint64\n0 3 6\nCONNECTIVITY vtktypeint64\n0 1 2 0 2 3\n"
MEDIT = (
    "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n" + XYZ.replace("\n", " 0\n")
    + "Triangles\n2\n1 2 3 0\n1 3 4 0\nEnd\n"
)  # fmt: skip
NODES = "1 0 0 0\n2 1 0 0.1\n3 1 .25 1\n4 0 0.5 1e-3\n"


def gmsh4(version: str) -> str:
    """Format 4.0 as Gmsh writes it, which calls it 4."""
    return (
        f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n$Nodes\n1 4\n1 2 0 4\n{NODES}$EndNodes\n"
        "$Elements\n1 2\n1 2 2 2\n1 1 2 3\n2 1 3 4\n$EndElements\n"
    )


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.off", f"OFF\n4 2 0\n{XYZ}{FACES}"),
        ("a.off", f"OFF\n\n# head\n4 2 0\n{XYZ}{FACES}".replace("\n", "\r\n")),
        ("a.ply", ply()),
        ("a.ply", binary_ply()),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", GRID)),
        ("a.vtk", legacy("UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n0.5",
                         f"CELLS 3 6\n{OFFSETS}CELL_TYPES 2\n5 5\n", "5.1")),
        ("a.mesh", MEDIT),
        ("a.msh", gmsh4("4")),
        ("a.msh", gmsh4("4.0")),
    ],
)  # fmt: skip
def test_plain_files_are_read(tmp_path, name, content):
    square(tmp_path / name, content)


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("a.off", f"COFF\n4 2 0\n{XYZ}{FACES}", PLAIN),
        ("a.off", f"OFF\n4 2 0\n{XYZ}3 0 1 2 0.5 0.25 1\n3 0 2 3 7\n", PLAIN),
        ("a.off", f"OFF\n4 2 0\n{XYZ}3 0 1 2\n3 0 2", "cut off: 8 numbers that follow each other"),
        ("a.ply", ply("property uchar red\n", "3 0 1 2 9\n3 0 2 3 9\n").replace("indices", "index"),
         PLAIN),
        ("a.ply", ply(rows="3 0 1 2\n"), "cut off"),
        ("a.ply", binary_ply("property uchar red\n", 1), "property: vertices, then faces that are"),
        ("a.ply", binary_ply()[:-1], "not a readable mesh"),
        ("a.ply", ply().replace("vertex 4", "edge 1\nproperty int a\nelement vertex 4"), PLAIN),
        ("a.ply", faces_first(), "element face: vertices, then faces"),
        ("a.vtk", legacy("POLYDATA", f"POLYGONS 2 8\n{FACES}"), PLAIN),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", GRID.replace("TYPES 2\n5", "TYPES 1")), "announced"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", f" points 4 double\n{XYZ}" + GRID), "points appears"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", GRID.replace("YPES 2\n5", "ypes 1")), "announced"),
        ("a.off", f"OFF\n4 1 0\n{XYZ}{FACES}", "more rows than the file"),
        ("a.obj", V.replace("v 1", "v\nv 1", 1) + "f 1 2 3\nf 1 3 4\n", "vertices: a row"),
        ("a.su2", "NDIME= 2\nNPOIN= 1\n0 0 0\nNPOIN= 1\n1 1 0\n", "NPOIN appears twice"),
        ("a.nas", "BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,1,,1.,0.,0.\nENDDATA\n", "GRID 1 appears"),
        ("a.f3grid", "G 1 0 0 0\nG 1 1 0 0\n", "G 1 appears twice"),
        ("a.mesh", MEDIT.replace("Triangles", f"Vertices 4\n{NODES}Triangles"), "Vertices appears"),
        ("a.ply", ply().replace("element face", "element vertex 4\nelement face"), "vertex app"),
        ("a.msh", gmsh4("4").replace("$Elements", f"$Nodes\n{NODES}$EndNodes\n$Elements"),
         "$Nodes appears twice"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", f"CELLS 2 {10**12}\n{FACES}"), "not a readable mesh"),
    ],
)  # fmt: skip
def test_what_else_there_is_is_refused(tmp_path, name, content, why):
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    assert why in refusal(tmp_path / name)


NETGEN = """# Generated by NETGEN

mesh3d
dimension
3
geomtype
0

# surfnr    bcnr   domin  domout      np      p1      p2      p3
surfaceelements
{count}
{faces}
#  matnr      np      p1      p2      p3      p4
volumeelements
1
 1 4 1 2 3 4

points
4
 0 0 0
 1 0 0
 0 1 0
 0 0 1

endmesh

csgsurfaces 6
plane 0 0 0
"""
SU2 = "NDIME= 3\nNELEM= 1\n10 0 1 2 3 0\nNPOIN= 4\n0 0 0 0\n1 0 0 1\n0 1 0 2\n0 0 1 3\nNMARK= 1\n"
SU2 += "MARKER_TAG= wall\nMARKER_ELEMS= 2\n5 0 1 2\n5 {face}\n"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.vol", NETGEN.format(count=2, faces=" 1 1 1 0 3 1 3 2\n 2 1 1 0 3 1 2 4\n")),
        ("a.su2", SU2.format(face="1 3 2")),
    ],
)
def test_the_boundary_beside_tetrahedra_is_left_out(tmp_path, name, content):
    (tmp_path / name).write_text(content)
    points, cells = read_here(tmp_path / name)
    assert points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert np.sort(cells).tolist() == [[0, 1, 2, 3]]


def test_triangles_that_are_no_faces_are_refused(tmp_path):
    more = SU2.replace("NPOIN= 4\n", "NPOIN= 5\n").replace("0 0 1 3\n", "0 0 1 3\n2 2 2 4\n")
    (tmp_path / "a.su2").write_text(more.format(face="1 3 4"))
    assert "['tetra', 'triangle'], allowed: only one of" in refusal(tmp_path / "a.su2")


def test_a_mesh_of_the_plane_lies_at_z_0(tmp_path):
    (tmp_path / "a.su2").write_text(
        "NDIME= 2\nNELEM= 2\n5 0 1 2 0\n5 0 2 3 1\nNPOIN= 4\n0 0 0\n1 0 1\n1 1 2\n0 1 3\n"
        "NMARK= 1\nMARKER_TAG= lower\nMARKER_ELEMS= 1\n3 0 1\n"
    )
    points, cells = read_here(tmp_path / "a.su2")
    assert points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert cells.tolist() == TRIANGLES
