"""Mesh files as other programs write them: exact points and cells, or an error in one line."""

from pathlib import Path

import numpy as np
import pytest

from mesh_files import read_here, refusal, write_mesh
from pdrom.model.mesh import reader

# as in the reader's process
pytestmark = pytest.mark.filterwarnings("ignore")
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 0.25, 1.0], [0.0, 0.5, 1e-3]])
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
V = "v 0 0 0\nv 1 0 0.1\nv 1 .25 1\nv 0 0.5 1e-3\n"
XYZ = "0 0 0\n1 0 0.1\n1 .25 1\n0 0.5 1e-3\n"
FACES = "3 0 1 2\n3 0 2 3\n"


def square(path: Path, content: str | bytes) -> None:
    """Check that the file contains the square."""
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
def test_faces_of_an_obj_file_are_read(tmp_path, content):
    square(tmp_path / "a.obj", content)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (V + "f 1 2 3\nf 1 3 4\ncall b.obj\n", "statement 'call' is not read"),
        (V + "f 1 2 3\nsurf 0 1 0 1 1 2 3\n", "statement 'surf'"),
        (V + "f 1 2 3\nf 1 3 4.5\n", "corners that are not whole numbers"),
        (V + "f 1 2 3\nf 1 3\n", "fewer than 3 corners"),
        (V.replace("v 1 .25 1", "v 1 .25") + "f 1 2 3\nf 1 3 4\n", "not a readable mesh (vertices"),
        (V * 5 + "f 1 2 3\nf 1 3 2", "truncated: .* incomplete"),
        (V + "f 1 2 3\nf 1 3", "truncated"),
        (V + "v 2 0 0\nv 2 0 1\nf 1 2 3 4\nf 2 5 6", "truncated"),  # of a quadrilateral
        (V + "f 1 2 3\nf 1/1 3/3 4", "truncated"),
        (V + "l 1 2 3 4\n", "only lines or points, which are not simulated"),
        ("f -3 -2 -1\nv 0 0 0\nv 1 0 0\nv 1 0 1.5", "truncated: .* incomplete"),
        (V + "f 1 2 3 \\\n", "faces: something other"),
        # a cut in a polygon that follows a triangle and a quadrilateral
        (V + "v 2 0 0\nv 2 0 1\nf 1 2 3\nf 1 2 3 4\nf 1 2 5 6", "truncated"),
    ],
)
def test_a_faulty_obj_file_is_refused(tmp_path, content, why):
    (tmp_path / "a.obj").write_text(content)
    found = refusal(tmp_path / "a.obj")
    assert any(all(word in found for word in part.split(" .* ")) for part in why.split("|")), found


VERTEX = "element vertex 4\n" + "".join(f"property double {axis}\n" for axis in "xyz")
FACE = "element face 2\nproperty list uchar int vertex_indices\n"


def ply(head: str, rows: str | bytes, order: str = "ascii") -> bytes:
    start = f"ply\nformat {order} 1.0\ncomment made here\n{head}end_header\n"
    return start.encode() + (rows if isinstance(rows, bytes) else rows.encode())


def binary_ply(
    counts: str, order: str = "<", after: int = 0, index: str = "vertex_indices"
) -> bytes:
    """Binary PLY with this type of corner counts, and some bytes and an edge after the faces."""
    kinds = {"uchar": "u1", "ushort": "u2", "int16": "i2"}
    faces = np.zeros(2, [("n", order + kinds[counts]), ("at", f"{order}u4", 3), ("", f"V{after}")])
    faces["n"], faces["at"] = 3, TRIANGLES
    head = VERTEX + f"element face 2\nproperty list {counts} uint {index}\n"
    head += "".join(f"property uint8 colour{i}\n" for i in range(after))
    head += "element edge 1\nproperty int vertex1\n"
    rows = POINTS.astype(f"{order}f8").tobytes() + faces.tobytes() + bytes(4)
    return ply(head, rows, f"binary_{'little' if order == '<' else 'big'}_endian")


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
    """Format 4.0 as Gmsh writes it, with the version number 4."""
    return (
        f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n$Nodes\n1 4\n1 2 0 4\n{NODES}$EndNodes\n"
        "$Elements\n1 2\n1 2 2 2\n1 1 2 3\n2 1 3 4\n$EndElements\n"
    )


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.off", f"OFF\n4 2 0\n{XYZ}{FACES}"),
        ("a.off", f"NCOFF\n4 2 0\n{XYZ}{FACES}"),
        ("a.off", f"OFF 4 2 0\n{XYZ}3 0 1 2\n3 0 2 3"),
        ("a.off", f"OFF\n\n# head\n4 2\n{XYZ}{FACES}".replace("\n", "\r\n")),
        ("a.off", "CNOFF\n4 2 0\n" + XYZ.replace("\n", " 0 1 0 255 0 0 # red\n")
         + FACES.replace("\n", " 0.5 0.25 1\n")),
        ("a.ply", ply(VERTEX + FACE, XYZ + FACES)),
        ("a.ply", ply(VERTEX + FACE, XYZ + FACES[:-1])),
        ("a.ply", ply(FACE + VERTEX, FACES + XYZ).replace(b"\n", b"\r\n")),
        ("a.ply", ply(VERTEX.replace("property double x", "property uchar red\nproperty double x")
                      + FACE.replace("indices", "index") + "property list uchar float texcoord\n",
                      "9 " + XYZ.replace("\n", "\n9 ")[:-2] + "3 0 1 2 2 .5 1\n3 0 2 3 0\n")),
        ("a.ply", binary_ply("uchar", after=3)),
        ("a.ply", binary_ply("ushort", ">")),
        ("a.ply", binary_ply("int16", index="vertex_index")),
        ("a.vtk", legacy("POLYDATA", f"LINES 1 5\n4 0 1 2 3\nPOLYGONS 2 8\n{FACES}")),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", GRID)),
        ("a.vtk", legacy("UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n0.5",
                         f"CELLS 3 6\n{OFFSETS}CELL_TYPES 2\n5 5\n", "5.1")),
        ("a.vtk", legacy("UNSTRUCTURED_GRID\nFIELD FieldData 2\nnames 1 2 string\na%20b\n\n"
                         "TIME 1 1 double\n0.5\nMETADATA\nCOMPONENT_NAMES\nx\n", GRID)),
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
        ("a.off", f"OFF\n4 1 0\n{XYZ}{FACES}", "more rows than the file"),
        ("a.ply", ply(VERTEX + FACE, XYZ + FACES + FACES), "more numbers than announced"),
        ("a.obj", V.replace("v 1", "v\nv 1", 1) + "f 1 2 3\nf 1 3 4\n", "vertices: a row"),
        ("a.off", f"OFF\n4 2 0\n{XYZ}3 0 1 2\n3 0 2", "truncated: a face of 3 corners"),
        ("a.off", f"4OFF\n4 2 0\n{XYZ}{FACES}", "no header"),
        ("a.ply", ply(VERTEX + FACE, XYZ + "3 0 1 2\n"), "truncated"),
        ("a.ply", binary_ply("uchar")[:-5], "truncated"),
        ("a.ply", ply(VERTEX + "element face 2\nproperty int a\n", XYZ + "1\n2\n"), "no cells"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", GRID.replace("TYPES 2\n5", "TYPES 1")),
             "truncated"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", f" points 4 double\n{XYZ}" + GRID), "POINTS appears"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", GRID.replace("YPES 2\n5", "ypes 1")), "truncated"),
        ("a.mesh", MEDIT.replace("Triangles", f" vertices 4\n{NODES}Triangles"), "ces appears"),
        ("a.ply", ply(VERTEX + VERTEX + FACE, XYZ + XYZ + FACES), "vertex appears twice"),
        ("a.msh", gmsh4("4").replace("$Elements", f"$Nodes\n{NODES}$EndNodes\n$Elements"),
         "$Nodes appears twice"),
        ("a.vtk", legacy("UNSTRUCTURED_GRID", f"CELLS 2 {10**12}\n{FACES}"), "not a readable mesh"),
    ],
)  # fmt: skip
def test_other_cells_and_formats_are_refused(tmp_path, name, content, why):
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    assert why in refusal(tmp_path / name)


def medit(axes: int, vertices: list, **sections: list) -> str:
    """A .mesh file of these sections, with a reference number at the end of each row."""
    text = f"MeshVersionFormatted 2\nDimension\n{axes}\n"
    for name, rows in {"Vertices": vertices, **sections}.items():
        lines = "".join(" ".join(map(str, row)) + " 7\n" for row in rows)
        text += f"{name}\n{len(rows)}\n{lines}"
    return text + "End\n"


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_surface_triangles_of_tetrahedra_are_left_out_if_they_are_faces(tmp_path):
    path = tmp_path / "a.mesh"
    solid = {"Tetrahedra": [[1, 2, 3, 4]], "Quadrilaterals": [[1, 2, 3, 4]]}
    path.write_text(medit(3, CORNERS, Triangles=[[1, 3, 2], [1, 2, 4]], **solid))
    points, cells = read_here(path)
    assert points.tolist() == CORNERS
    assert cells.tolist() == [[0, 1, 2, 3]]
    path.write_text(medit(3, [*CORNERS, [2, 2, 2]], Triangles=[[1, 3, 5]], **solid))
    assert "tetrahedra and triangles that are not their faces" in refusal(path)


def test_a_mesh_of_the_plane_lies_at_z_0(tmp_path):
    sections = {"Edges": [[1, 2]], "Triangles": [[1, 2, 3], [1, 3, 4]]}
    (tmp_path / "a.mesh").write_text(medit(2, [[0, 0], [1, 0], [1, 1], [0, 1]], **sections))
    points, cells = read_here(tmp_path / "a.mesh")
    assert points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert cells.tolist() == TRIANGLES


def test_strings_of_a_binary_vtk_are_left_out(tmp_path):
    """A string follows its length, which has one byte or two."""
    mesh, path, grid = write_mesh(tmp_path / "a.vtk"), tmp_path / "a.vtk", b"UNSTRUCTURED_GRID\n"
    field = b"FIELD f 1\nnames 1 2 string\n\xc2ab\x80\x40" + 64 * b"c" + b"\n"
    path.write_bytes(path.read_bytes().replace(grid, grid + field))
    assert np.array_equal(read_here(path)[0], mesh.points)


def areas(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Twice the areas of triangles in the plane z = 0, with signs."""
    a, b, c = points[cells.T]
    return np.cross(b - a, c - a)[:, 2]


@pytest.mark.parametrize(
    ("outline", "triangles"),
    [
        ([[0, 0], [3, 0], [4, 1], [1, 1]], [[1, 2, 3], [1, 3, 0]]),  # at the shorter diagonal
        ([[0, 0], [2, 0], [2, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]]),
        ([[-1, 0], [0, 1], [1, 0], [0, 9]], None),  # an arrow, whose shorter diagonal lies outside
        ([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], None),  # an L
        ([[0, 0], [1, 0], [2, 0], [2, 2], [0, 2]], None),  # three corners on a line
    ],
)
def test_polygons_are_split_into_triangles_inside(tmp_path, outline, triangles):
    path, count = tmp_path / "a.obj", len(outline)
    corners = " ".join(str(i + 1) for i in range(count))
    vertices = "".join(f"v {x} {y} 0\n" for x, y in outline)
    path.write_text(f"{vertices}f 1 2 3\nf {corners}\nf 1 2 3\n")
    points, cells, remark = reader.read(str(path), 100, 100)
    assert remark == f"1 of 3 faces are polygons, split into triangles: {count}"
    assert cells[[0, -1]].tolist() == 2 * [[0, 1, 2]]
    if triangles:
        assert cells[1:-1].tolist() == triangles
    signed = areas(points, cells[1:-1])
    x, y = np.array(outline).T
    whole = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    assert (signed * whole > 0).all()
    assert signed.sum() == pytest.approx(whole)


def solid(names: tuple[str, str] = ("solid a facet", "endsolid"), upper: bool = False) -> str:
    corners = "".join("vertex {} {} {}\n".format(*point) for point in POINTS[[0, 1, 2]].tolist())
    facet = f"facet normal nan nan nan\nouter loop\n{corners}endloop\nendfacet\n"
    text = f"{names[0]}\n{facet}{names[1]}\n"
    return text.upper() if upper else text


def binary_stl(head: bytes, tail: bytes = b"") -> bytes:
    facet = np.zeros(1, [("normal", "<f4", 3), ("at", "<f4", (3, 3)), ("attribute", "<u2")])
    facet["at"], facet["attribute"] = POINTS[[0, 1, 2]], 9
    return head.ljust(80) + b"\1\0\0\0" + facet.tobytes() + tail


@pytest.mark.parametrize(
    "content",
    [
        solid(), solid(upper=True), solid().replace("\n", "\r\n  "), solid() + "\nmade by x 1 2\n",
        binary_stl(b"solid by x"), binary_stl(b"x", tail=b"\0\0\0"),
    ],
)  # fmt: skip
def test_an_stl_file_is_read_and_a_cut_one_is_refused(tmp_path, content):
    path = tmp_path / "a.stl"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    points, cells = read_here(path)
    assert points[cells].astype(np.float32).tolist() == [POINTS[:3].astype(np.float32).tolist()]
    path.write_bytes(path.read_bytes()[:100])
    assert "truncated" in refusal(path)


BINARY = (
    b"$MeshFormat\n2.2 1 8\n\1\0\0\0$EndMeshFormat\n$Nodes\n4\n"
    + b"".join(np.int32(i + 1).tobytes() + POINTS[i].tobytes() for i in range(4))
    + b"$EndNodes\n$Elements\n2\n"
    + np.array([2, 2, 0, 1, 1, 2, 3, 2, 1, 3, 4], "<i4").tobytes()
)
PARTS = (
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 0\n1 0 0 0 1 1 1 0 0\n$EndEntities\n"
    "$PartitionedEntities\n2\n1 9 1\n0 0 2 0\n2 2 1 1 1 0 0 0 1 0 1 0 0\n"
    "3 2 1 1 2 1 0 0 2 0 1 0 0\n"
    "$EndPartitionedEntities\n$Nodes\n2 4 10 40\n2 2 0 3\n40\n10\n30\n{}2 3 1 1\n20\n{}"
    "$EndNodes\n$Elements\n2 2 1 2\n2 2 2 1\n1 40 10 30\n2 3 2 1\n2 40 30 20\n$EndElements\n"
    "$GhostElements\n1\n1 1 1 2\n$EndGhostElements\n"
).format("0 0 0\n1 0 0.1\n1 .25 1\n", "0 0.5 1e-3 0.5 0.5\n")  # the last node has parameters


@pytest.mark.parametrize(
    "content", [BINARY + b"$EndElements\n", BINARY + b"\n$EndElements\n$Data", PARTS.encode()]
)
def test_msh_of_other_programs_and_of_partitions(tmp_path, content):
    square(tmp_path / "a.msh", content)
    (tmp_path / "a.msh").write_bytes(content[: content.index(b"$EndElements")])
    assert "truncated" in refusal(tmp_path / "a.msh")


def piece(count: int) -> str:
    """A piece of a .vtu file with the first triangles of the square and their vertices."""
    points, ends = POINTS[: count + 2 if count else 0], 3 * np.arange(1, count + 1)
    names = {"": points, "connectivity": TRIANGLES[:count], "offsets": ends, "types": [5] * count}
    texts = [
        f'<DataArray type="Float64" Name="{name}" format="ascii">'
        f"{' '.join(map(repr, np.ravel(values).tolist()))}</DataArray>"
        for name, values in names.items()
    ]
    head = f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{count}"><Points>'
    return f"{head}{texts[0]}</Points><Cells>{''.join(texts[1:])}</Cells></Piece>"


VTU = '<VTKFile type="UnstructuredGrid"><UnstructuredGrid>{}</UnstructuredGrid></VTKFile>'


def test_pieces_of_a_vtu_are_joined_and_bytes_behind_its_end_are_ignored(tmp_path):
    square(tmp_path / "a.vtu", VTU.format(piece(2) + piece(0)) + "\n<!-- x -->\0\0")
    (tmp_path / "a.vtu").write_text(VTU.format(piece(1) + piece(2)))
    points, cells = read_here(tmp_path / "a.vtu")
    assert np.array_equal(points, np.concatenate([POINTS[:3], POINTS]))
    assert cells.tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6]]


@pytest.mark.parametrize("code", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_skipped(tmp_path, code):
    square(tmp_path / "a.obj", (V + "f 1 2 3\nf 1 3 4\n").encode(code))
