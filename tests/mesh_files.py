"""Small mesh files of every format that is read, and broken ones."""

import base64
import struct
import zlib
from pathlib import Path

import meshio
import numpy as np

from pdrom.model.mesh import reader
from pdrom.model.mesh.files import FORMATS
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.types import Mesh

# An extension, meshio's reader, and whether the file holds tetrahedra: every reader once.
VOLUMES = ("su2", "flac3d", "gmsh", "medit", "netgen", "vtk")
KINDS = [
    (".lb8.ugrid" if name == "ugrid" else suffix, name)
    for suffix, names in FORMATS.items()
    for name in names
]


def write_mesh(path: Path, name: str) -> Mesh:
    """Write a small mesh by the writer called ``name``, and return it."""
    if name in VOLUMES:
        mesh = bar(3, 2, 2)
        cells = ("tetra", mesh.tetrahedra)
    else:
        mesh = cloth(4, 3, wave=0.25)
        cells = ("triangle", mesh.triangles)
    # few digits, as some formats have few columns for them
    points = mesh.points.round(3)
    meshio.write(path, meshio.Mesh(points, [cells]), file_format=name)
    return Mesh(points, mesh.triangles, mesh.tetrahedra)


def read_here(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a file, read in this process."""
    return reader.read(str(path), list(FORMATS[path.suffix]), 10**6, 10**6)


def refusal(path: Path) -> str:
    """Why the file is refused, on one line; nothing if it is read."""
    said = ""
    try:
        read_here(path)
    except ValueError as error:
        said = str(error)
    assert "\n" not in said
    return said


def zeros_vtu(blocks: int) -> str:
    """A .vtu file with ``blocks`` times 4 MiB of zeros as its points, compressed."""
    size = 1 << 22
    block = zlib.compress(bytes(size), 9)
    header = struct.pack(f"<{3 + blocks}I", blocks, size, 0, *[len(block)] * blocks)
    data = base64.b64encode(header).decode() + base64.b64encode(block * blocks).decode()
    return (
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" '
        'compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{blocks * size // 24}" NumberOfCells="1"><Points>'
        '<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="binary">'
        f"{data}</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"
    )
