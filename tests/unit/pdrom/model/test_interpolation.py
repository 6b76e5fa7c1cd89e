"""Interpolation from a mesh: exact for affine functions, at the nearest point of the mesh."""

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import Delaunay

from pdrom.model import coarser
from pdrom.model.mesh.generators import cloth
from pdrom.model.mesh.types import Mesh


@pytest.fixture(params=["volume", "sheet"])
def mesh(request: pytest.FixtureRequest, rng: np.random.Generator) -> Mesh:
    """Tetrahedra that are small near the origin, or a curved sheet of rows of unequal heights."""
    if request.param == "sheet":
        sheet = cloth(12, 12, wave=0.2)
        x, y, z = (sheet.points - sheet.points.min(axis=0)).T
        return Mesh(np.column_stack([x, y**4, z + 0.3 * np.cos(3.0 * x)]), sheet.triangles)
    points = rng.random((60, 3)) ** 3
    cells = Delaunay(points).simplices
    volumes = np.abs(np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]))
    return Mesh(points, np.empty((0, 3), np.int32), cells[volumes > 1e-9].astype(np.int32))


def distance(corners: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point from a simplex, by least squares with non-negative shares."""
    whole = np.vstack([corners.T, np.full(len(corners), 1e5)])  # the sum of the shares is one
    return float(np.linalg.norm(nnls(whole, np.append(point, 1e5))[0] @ corners - point))


def test_a_point_inside_has_affine_values_a_point_outside_those_of_the_nearest_point(
    mesh, rng, monkeypatch
):
    for name, few in (("PAIRS", 500), ("FIRST", 1)):  # the search continues in parts
        monkeypatch.setattr(coarser, name, few)
    cells = mesh.tetrahedra if len(mesh.tetrahedra) else mesh.triangles
    shares = rng.dirichlet(np.ones(cells.shape[1]), len(cells))
    inside = np.einsum("em,emd->ed", shares, mesh.points[cells])
    outside = rng.uniform(-0.3, 1.3, (12, 3))
    matrix = coarser.interpolation(mesh, np.vstack([inside, outside]))
    assert (matrix.data >= 0.0).all()
    assert matrix.sum(axis=1) == pytest.approx(1.0, abs=1e-14)
    own = {frozenset(cell) for cell in cells.tolist()}
    assert {frozenset(used) for used in matrix.indices.reshape(-1, cells.shape[1]).tolist()} <= own
    found = matrix @ mesh.points
    assert found[: len(cells)] == pytest.approx(inside, abs=1e-8)
    apart = np.linalg.norm(found[len(cells) :] - outside, axis=1)
    least = [min(distance(mesh.points[cell], point) for cell in cells) for point in outside]
    assert apart == pytest.approx(least, abs=1e-6)
