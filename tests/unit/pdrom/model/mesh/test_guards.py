"""Complete mesh files of other programs are read exactly; cut files are refused or complete."""

import numpy as np
import pytest

from mesh_files import VOLUMES, read_here, refusal, write_mesh

# as in the reader's process
pytestmark = pytest.mark.filterwarnings("ignore")
# meshio's writer, the extension, and options of the writer
VARIANTS = [
    ("gmsh", ".msh", {}), ("gmsh", ".msh", {"binary": False}), ("gmsh22", ".msh", {}),
    ("gmsh22", ".msh", {"binary": False}), ("medit", ".mesh", {}), ("obj", ".obj", {}),
    ("off", ".off", {}), ("ply", ".ply", {}), ("ply", ".ply", {"binary": False}),
    ("stl", ".stl", {}), ("stl", ".stl", {"binary": True}), ("vtk", ".vtk", {}),
    ("vtk", ".vtk", {"binary": False}), ("vtk42", ".vtk", {}), ("vtk42", ".vtk", {"binary": False}),
    ("vtu", ".vtu", {}), ("vtu", ".vtu", {"binary": False}), ("vtu", ".vtu", {"compression": None}),
]  # fmt: skip
CUTS = 25


@pytest.mark.parametrize(("writer", "suffix", "more"), VARIANTS)
@pytest.mark.parametrize("kind", ["triangle", "tetra"])
def test_complete_files_are_exact_and_cut_files_are_refused(tmp_path, writer, suffix, more, kind):
    if kind == "tetra" and suffix not in VOLUMES:
        pytest.skip("a format of surfaces")
    path = tmp_path / f"mesh{suffix}"
    mesh = write_mesh(path, kind, writer, **more)
    cells = mesh.tetrahedra if kind == "tetra" else mesh.triangles
    found, listed = read_here(path)
    if writer == "stl":  # an .stl file repeats the corners of each triangle
        corners = mesh.points[cells].astype(np.float32)
        assert np.array_equal(found[listed].astype(np.float32), corners)
    else:
        assert np.array_equal(found, mesh.points)
        assert np.array_equal(listed, cells)
    content = path.read_bytes()
    end = len(content.rstrip())
    cuts = np.random.default_rng(3).integers(0, end, CUTS)
    for cut in [*cuts, *range(end - CUTS, end)]:
        path.write_bytes(content[:cut])
        said = refusal(path)
        if said:
            assert said.startswith(("not a readable mesh (", "holds ")), said
            continue
        points, cells = read_here(path)
        assert np.array_equal(points, found), cut
        # an .obj file has no counts: a cut between two lines of faces is not noticed
        between = suffix == ".obj" and content[cut - 1 : cut + 1].count(b"\n")
        assert np.array_equal(cells, listed[: len(cells)]), cut
        assert len(cells) == len(listed) or between, cut
