"""Interpolation from a mesh: exact for affine functions, at the nearest point of the mesh."""

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import Delaunay

from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.transfer import interpolation
from pdrom.model.mesh.types import Mesh


def cloud(rng: np.random.Generator) -> Mesh:
    """Tetrahedra of a thousand times different volumes: small ones near the origin."""
    points = rng.random((60, 3)) ** 3
    cells = Delaunay(points).simplices
    volumes = np.abs(np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]))
    return Mesh(points, np.empty((0, 3), np.int32), cells[volumes > 1e-9].astype(np.int32))


def graded(rng: np.random.Generator) -> Mesh:
    """Curved sheet of 12 x 12 vertices, with rows of very different heights."""
    mesh = cloth(12, 12, wave=0.2)
    x, y, z = mesh.points.T
    return Mesh(np.column_stack([x, (y - y.min()) ** 4, z + 0.3 * np.cos(3.0 * x)]), mesh.triangles)


MESHES = pytest.mark.parametrize("make", [cloud, graded], ids=["volume", "sheet"])


def distance(corners: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point from a simplex, by least squares with non-negative shares."""
    whole = np.vstack([corners.T, np.full(len(corners), 1e5)])  # the shares' sum is one
    shares = nnls(whole, np.append(point, 1e5))[0]
    return float(np.linalg.norm(shares @ corners - point))


@MESHES
def test_weights_are_shares_on_one_element_and_a_vertex_has_its_own_value(make, rng):
    mesh = make(rng)
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    matrix = interpolation(mesh, np.vstack([mesh.points, rng.standard_normal((40, 3))]))
    used = np.unique(cells)
    assert (matrix.data >= 0.0).all()
    assert matrix.sum(axis=1) == pytest.approx(1.0, abs=1e-14)
    assert {tuple(sorted(own)) for own in matrix.indices.reshape(-1, cells.shape[1])} <= {
        tuple(sorted(cell)) for cell in cells
    }
    assert matrix[used][:, used].toarray() == pytest.approx(np.eye(len(used)), abs=1e-6)


@MESHES
def test_affine_functions_are_exact_inside(make, rng):
    mesh = make(rng)
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    shares = rng.dirichlet(np.ones(cells.shape[1]), len(cells))
    inside = np.einsum("em,emd->ed", shares, mesh.points[cells])
    slope, constant = rng.standard_normal((3, 2)), rng.standard_normal(2)
    found = interpolation(mesh, inside) @ (mesh.points @ slope + constant)
    assert found == pytest.approx(inside @ slope + constant, abs=1e-8)


@MESHES
def test_a_point_outside_gets_the_nearest_point_of_all_elements(make, rng):
    mesh = make(rng)
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    low, span = mesh.points.min(axis=0), np.ptp(mesh.points, axis=0).max()
    points = low + span * rng.uniform(-0.3, 1.3, (12, 3))
    apart = np.linalg.norm(interpolation(mesh, points) @ mesh.points - points, axis=1)
    least = [min(distance(mesh.points[cell], point) for cell in cells) for point in points]
    assert apart == pytest.approx(least, abs=1e-6)


def test_many_elements_are_searched_in_parts(monkeypatch, rng):
    mesh, points = bar(9, 5, 5), rng.uniform(-1.0, 3.0, (50, 3))
    whole = interpolation(mesh, points)
    monkeypatch.setattr("pdrom.model.mesh.transfer.PAIRS", 40)
    assert (interpolation(mesh, points) != whole).nnz == 0
