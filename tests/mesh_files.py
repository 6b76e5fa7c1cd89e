"""Small mesh files of every format that is read, and broken ones."""

import base64
import struct
import zlib
from pathlib import Path

import meshio
import numpy as np

from pdrom.model.mesh import reader
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.types import Mesh

# Formats of tetrahedra, and names of meshio's writers that differ from the extension.
VOLUMES = (".msh", ".mesh", ".vtk", ".vtu")
WRITERS = {".msh": "gmsh", ".mesh": "medit"}


def write_mesh(path: Path, kind: str = "triangle", writer: str = "", **more: object) -> Mesh:
    """Write a small mesh with cells of this kind and scrambled vertices, and return it."""
    mesh = bar(3, 2, 2) if kind == "tetra" else cloth(4, 3, wave=0.25)
    order = np.random.default_rng(2).permutation(mesh.vertices)
    points = np.empty_like(mesh.points)
    points[order] = mesh.points.round(3)
    made = Mesh(points, order[mesh.triangles], order[mesh.tetrahedra])
    cells = made.tetrahedra if kind == "tetra" else made.triangles
    format_ = writer or WRITERS.get(path.suffix, path.suffix[1:])
    meshio.write(path, meshio.Mesh(points, [(kind, cells)]), file_format=format_, **more)
    return made


def read_here(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a file, read in this process."""
    return reader.read(str(path), 10**6, 10**6)[:2]


def refusal(path: Path) -> str:
    """Reason of the refusal on one line, empty if the file is read."""
    said = ""
    try:
        read_here(path)
    except ValueError as error:
        said = str(error)
    assert "\n" not in said
    assert "Error" not in said
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
