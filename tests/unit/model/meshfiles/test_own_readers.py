"""Ordinary .obj, .off, .ply and .vtk files, as programs write them: points and cells exactly."""

from pathlib import Path

import numpy as np
import pytest

from pdrom.model.mesh import reader
from pdrom.model.mesh.files import FORMATS

# as in the reader's process
pytestmark = pytest.mark.filterwarnings("ignore")
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 0.25, 1.0], [0.0, 0.5, 1e-3]])
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
V = "v 0 0 0\nv 1 0 0.1\nv 1 .25 1\nv 0 0.5 1e-3\n"
XYZ = "0 0 0\n1 0 0.1\n1 .25 1\n0 0.5 1e-3\n"
FACES = "3 0 1 2\n3 0 2 3\n"


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a file, read in this process."""
    return reader.read(str(path), list(FORMATS[path.suffix]), 10**6, 10**6)


def message(path: Path) -> str:
    """Why the file is refused, on one line."""
    with pytest.raises(ValueError, match=r"\A[^\n]*\Z") as caught:
        read(path)
    return str(caught.value)


def square(path: Path, content: str | bytes) -> None:
    """The file holds the square."""
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    points, triangles = read(path)
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
        V + "f 1 \\\n2 3\nf 1 3 \\  \r\n4\n",
        V.replace(" ", "\t").replace("\n", "\r\n") + "\r\n  f 1 2  3 # one\r\nf\t1 3 4\r\n",
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
    found = message(tmp_path / "a.obj")
    assert any(all(word in found for word in part.split(" .* ")) for part in why.split("|")), found


@pytest.mark.parametrize(
    "content",
    [
        f"OFF\n4 2 0\n{XYZ}{FACES}",
        f"OFF 4 2 5\n{XYZ}{FACES}",
        f"  OFF\n\n# head\n4 2\n\n{XYZ}\n{FACES}",
        f"OFF # head\n4 2 0 # counts\n{XYZ}" + FACES.replace("\n", " # face\n"),
        "COFF\n4 2 0\n" + XYZ.replace("\n", " 255 0 0 255\n") + FACES,
        "STCNOFF\n4 2 0\n" + XYZ.replace("\n", " 0 1 0 0.5 0 0 1 0.3 0.4\n") + FACES,
        f"OFF\n4 2 0\n{XYZ}3 0 1 2 0.5 0.25 1\n3 0 2 3 7\n",
        f"OFF\n4  2  0\n{XYZ}{FACES}".replace("\n", "\r\n"),
        f"OFF\n4 2 0\n{XYZ}{FACES}"[:-1],
    ],
)
def test_off(tmp_path, content):
    square(tmp_path / "a.off", content)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("", "the first line is not OFF"),
        (f"4OFF\n4 2 0\n{XYZ}{FACES}", "the first line is not OFF"),
        ("OFF BINARY\n4 2 0\n", "the first line is not OFF"),
        ("OFF\n", "cut off: the file ends before its counts"),
        (f"OFF\n4 2 0\n{XYZ}3 0 1 2\n", "cut off: 4 vertices and 2 faces are announced, 5 lines"),
        (f"OFF\n4 2 0\n{XYZ}3 0 1 2\n3 0 2", "cut off?"),
        (f"OFF\n4 1 0\n{XYZ}4 0 1 2 3\n", "holds cells ['quad'], allowed: only one of triangle"),
        (f"OFF\n4 2 0\n{XYZ}3 0 1 2\n3 0 2 x\n", "not a readable mesh (faces: could not convert"),
    ],
)
def test_faulty_off(tmp_path, content, why):
    (tmp_path / "a.off").write_text(content)
    assert why in message(tmp_path / "a.off")


def ply(vertex: str, rows: str, face: str, faces: str, before: str = "", after: str = "") -> str:
    """A text file with these properties and rows."""
    return (
        f"ply\nformat ascii 1.0\ncomment made here\n{before}element vertex 4\n{vertex}obj_info x\n"
        f"element face 2\n{face}{after}end_header\n{rows}{faces}"
    )


AXES = "property float x\nproperty float y\nproperty float z\n"
CORNERS = "property list uchar int vertex_indices\n"


@pytest.mark.parametrize(
    "content",
    [
        ply(AXES, XYZ, CORNERS, FACES),
        ply(AXES, XYZ, CORNERS, FACES)[:-1],
        ply(AXES, XYZ, CORNERS.replace("indices", "index"), FACES).replace("\n", "\r\n"),
        ply(AXES + "property uchar red\n", XYZ.replace("\n", " 255\n"), CORNERS, FACES),
        ply(
            "property short q\nproperty float z\nproperty double x\nproperty float32 y\n",
            "7 0 0 0\n7 0.1 1 0\n7 1 1 .25\n7 1e-3 0 .5\n", CORNERS, FACES,
        ),
        ply(
            AXES, XYZ,
            "property uchar red\n" + CORNERS + "property list uchar float texcoord\n",
            "9 3 0 1 2 2 0.5 0.5\n9 3 0 2 3 2 0 1\n",
        ),
        ply(
            AXES, XYZ, CORNERS, FACES + "0 1\n",
            after="element edge 1\nproperty int a\nproperty int b\n",
        ),
        ply(
            AXES, "5\n6\n" + XYZ, CORNERS, FACES,
            before="element material 2\nproperty int kind\n",
        ),
    ],
)  # fmt: skip
def test_ply(tmp_path, content):
    square(tmp_path / "a.ply", content)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("count", ["u1", "i4"])
def test_binary_ply(tmp_path, order, count):
    """Properties in another order, between others; the numbers have the bytes of their types."""
    name = {"<": "little", ">": "big"}[order]
    head = f"ply\nformat binary_{name}_endian 1.0\nelement vertex 4\nproperty uchar red\n"
    head += "property double z\nproperty double y\nproperty ushort q\nproperty double x\n"
    length = {"u1": "uchar", "i4": "int"}[count]
    head += f"element face 2\nproperty list {length} uint vertex_index\nproperty float area\n"
    head += "end_header\n"
    vertex = np.dtype([("r", "u1"), ("z", order + "f8"), ("y", order + "f8"), ("q", order + "u2"),
                       ("x", order + "f8")])  # fmt: skip
    vertices = np.zeros(4, vertex)
    for axis, column in zip("xyz", POINTS.T, strict=True):
        vertices[axis] = column
    faces = np.zeros(2, [("n", order + count), ("c", order + "u4", 3), ("a", order + "f4")])
    faces["n"], faces["c"] = 3, TRIANGLES
    content = head.encode() + vertices.tobytes() + faces.tobytes()
    square(tmp_path / "a.ply", content)
    for cut in range(len(head), len(content)):
        (tmp_path / "a.ply").write_bytes(content[:cut])
        assert "cut off: " in message(tmp_path / "a.ply")
    faces["n"][1] = 4
    (tmp_path / "a.ply").write_bytes(head.encode() + vertices.tobytes() + faces.tobytes())
    assert "lists vertex_index of unlike lengths: 3, 4" in message(tmp_path / "a.ply")


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("ply\n", "cut off: the header has no end_header"),
        ("plx\n", "the first line is not ply"),
        ("ply\nformat ascii 2.0\n", "the header's line 'format ascii 2.0'"),
        (ply(AXES + "property quad q\n", XYZ, CORNERS, FACES), "the header's line 'property quad"),
        (ply(AXES, XYZ, CORNERS, "3 0 1 2\n"), "cut off: 2 rows of face announced, 1 are there"),
        (ply(AXES, XYZ, CORNERS, "3 0 1 2\n4 0 1 2 3\n"), "number of columns changed"),
        (ply(AXES, XYZ, CORNERS, "4 0 1 2 3\n" * 2), "holds cells ['quad']"),
        (ply(AXES, XYZ, CORNERS, "3 0 1 2 9\n" * 2), "rows of 5 numbers, expected: 4"),
        (ply(AXES[:-17], XYZ, CORNERS, FACES), "vertex: rows of 3 numbers, expected: 2"),
        (ply("property int q\n", "1\n" * 4, CORNERS, FACES), "properties x, y and z"),
    ],
)
def test_faulty_ply(tmp_path, content, why):
    (tmp_path / "a.ply").write_text(content)
    assert why in message(tmp_path / "a.ply")


def legacy(dataset: str, sections: str, version: str = "3.0") -> str:
    return (
        f"# vtk DataFile Version {version}\nsheet\nASCII\nDATASET {dataset}\n"
        f"POINTS 4 float\n{XYZ}{sections}"
    )


OFFSETS = "OFFSETS vtktypeint64\n0 3 6\nCONNECTIVITY vtktypeint64\n0 1 2 0 2 3\n"


@pytest.mark.parametrize(
    "content",
    [
        legacy("POLYDATA", f"POLYGONS 2 8\n{FACES}"),
        legacy("POLYDATA", f"POLYGONS 2 8\n{FACES}"[:-1]),
        legacy("polydata", f"VERTICES 1 2\n1 3\nLINES 2 7\n2 0 1\n3 1 2 3\nPOLYGONS 2 8\n{FACES}"
               "CELL_DATA 2\nSCALARS a int 1\nLOOKUP_TABLE default\n1\n2\n"),
        legacy("POLYDATA", "METADATA\nINFORMATION 1\nNAME L2 LOCATION vtk\nDATA 2 0 1\n\n"
               f"POLYGONS 3 6\n{OFFSETS}", "5.1"),
        legacy("UNSTRUCTURED_GRID", f"CELLS 2 8\n{FACES}CELL_TYPES 2\n5\n5\n"),
        legacy("UNSTRUCTURED_GRID", f"CELLS 2 8\n{FACES}CELL_TYPES 2\n7 5\nPOINT_DATA 4\nx"),
        legacy("UNSTRUCTURED_GRID", f"CELLS 4 13\n1 0\n{FACES}2 1 2\nCELL_TYPES 4\n1 5 5 3\n"),
        legacy("UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n0.5",
               f"CELLS 3 6\n{OFFSETS}CELL_TYPES 2\n5 5\n", "5.1"),
    ],
)  # fmt: skip
def test_vtk(tmp_path, content):
    square(tmp_path / "a.vtk", content)


@pytest.mark.parametrize("newline", [b"\n", b""])
def test_binary_polydata(tmp_path, newline):
    content = b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 4 double\n"
    content += POINTS.astype(">f8").tobytes() + newline + b"POLYGONS 2 8\n"
    content += np.insert(TRIANGLES, 0, 3, axis=1).astype(">i4").tobytes()
    square(tmp_path / "a.vtk", content + newline)
    for cut in range(100, len(content)):
        (tmp_path / "a.vtk").write_bytes(content[:cut])
        assert "cut off" in message(tmp_path / "a.vtk") or cut in range(100, 84 + 96 + 14)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("# vtk DataFile Version 3.0\nx\n", "with ASCII or BINARY"),
        (legacy("STRUCTURED_GRID", ""), "the section 'DATASET STRUCTURED_GRID' is not read"),
        (legacy("POLYDATA", ""), "cut off: the file ends before its cells"),
        (legacy("POLYDATA", "POLYGONS 2 8\n3 0 1 2\n"), "cut off: 8 numbers"),
        (legacy("POLYDATA", "POLYGONS 2 8\n3 0 1 2\n3 0 x 2\n"), "not a readable mesh"),
        (legacy("POLYDATA", "POLYGONS 2 9\n3 0 1 2\n4 0 1 2 3\n"), "['triangle', 'polygon']"),
        (legacy("POLYDATA", "TRIANGLE_STRIPS 1 5\n4 0 1 2 3\n"), "['triangle strip']"),
        (legacy("POLYDATA", "POLYGONS 2 8\n3 0 1 2\n2 0 1 7\n"), "a list of another length"),
        (legacy("POLYDATA", f"POLYGONS 3 6\n{OFFSETS}".replace("3 6", "3 9", 2), "5.1"), "cut off"),
        (legacy("UNSTRUCTURED_GRID", f"CELLS 2 8\n{FACES}"), "ends before its CELL_TYPES"),
        (legacy("UNSTRUCTURED_GRID", f"CELLS 2 8\n{FACES}CELL_TYPES 1\n5\n"), "not as many"),
        (legacy("UNSTRUCTURED_GRID", f"CELLS 2 8\n{FACES}CELL_TYPES 2\n10 10\n"), "not 4 corners"),
        (legacy("POLYDATA", f"POLYGONS 2 {10**12}\n{FACES}"), "cut off: 1000000000000 numbers"),
    ],
)
def test_faulty_vtk(tmp_path, content, why):
    (tmp_path / "a.vtk").write_text(content)
    assert why in message(tmp_path / "a.vtk")
