"""Unstructured shapes: what they enclose, how good their elements are, the same bytes each time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.mesh.measures import vertex_measures
from pdrom.model.mesh.select import select_vertices
from pdrom.model.mesh.selection import BoundaryLoop
from pdrom.model.mesh.shapes import SURFACES, TUBE, disc, shell, solid
from pdrom.model.mesh.types import Mesh

MESH = TypeAdapter(MeshConfig)


def aspects(mesh: Mesh) -> np.ndarray:
    """Longest over shortest edge of each triangle."""
    corner = mesh.points[mesh.triangles]
    edges = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)
    return edges.max(axis=1) / edges.min(axis=1)


def volume(mesh: Mesh) -> float:
    """Of what the triangles enclose, positive if they face outwards."""
    a, b, c = (mesh.points[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def euler(mesh: Mesh) -> int:
    return mesh.vertices - len(mesh.edges()) + len(mesh.triangles)


@settings(max_examples=8)
@given(edge=st.floats(0.03, 0.12), hole=st.sampled_from([0.0, 0.2, 0.6]), size=st.floats(0.1, 10))
def test_a_disc_has_its_area_and_its_rims(edge, hole, size):
    mesh = check_mesh(disc(edge * size, hole, "xz", size, 3.0), "disc")
    assert mesh.extent == pytest.approx(size, rel=0.05)
    area = 0.25 * np.pi * size**2 * (1.0 - hole**2)
    assert vertex_measures(mesh).sum() == pytest.approx(area, rel=0.1)
    assert (mesh.points[:, 1] == 3.0).all()
    assert euler(mesh) == (0 if hole else 1)
    outer = select_vertices(mesh, BoundaryLoop(index=0))
    assert np.linalg.norm(mesh.points[outer][:, [0, 2]], axis=1) == pytest.approx(0.5 * size)
    # no angle below 30 degrees inside, a little less at short holes
    assert aspects(mesh).max() < 2.5


@pytest.mark.parametrize(("shape", "holes"), [("ball", 0), ("torus", 1), ("starfish", 0)])
def test_shells_are_closed_and_face_outwards(shape, holes):
    mesh = check_mesh(shell(shape, 0.08, 2.0, 1.0), shape)
    edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert euler(mesh) == 2 - 2 * holes
    assert volume(mesh) > 0.0
    assert mesh.extent == pytest.approx(2.0)
    assert 0.5 * (mesh.points[:, 1].min() + mesh.points[:, 1].max()) == pytest.approx(1.0)
    assert aspects(mesh).max() < (6.0 if shape == "starfish" else 2.5)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ("ball", np.pi / 6.0),
        # tube radius r and radius R of its centre line with R + r = 1/2
        ("torus", 2.0 * np.pi**2 * TUBE**2 * (0.5 / (1.0 + TUBE)) ** 3),
    ],
)
def test_solids_have_the_volume_of_their_shape(shape, expected):
    mesh = check_mesh(solid(shape, 0.06, 1.0, 0.0), shape)
    assert vertex_measures(mesh).sum() == pytest.approx(expected, rel=0.04)
    assert volume(mesh) == pytest.approx(vertex_measures(mesh).sum())


@pytest.mark.parametrize("shape", SURFACES)
def test_a_solid_keeps_the_surface_and_is_the_same_each_time(shape):
    surface, body = shell(shape, 0.1, 1.0, 0.0), solid(shape, 0.1, 1.0, 0.0)
    assert np.array_equal(np.unique(body.triangles), np.arange(surface.vertices))
    assert np.array_equal(body.points[: surface.vertices], surface.points)
    again = solid(shape, 0.1, 1.0, 0.0)
    for name in ("points", "triangles", "tetrahedra"):
        assert getattr(body, name).tobytes() == getattr(again, name).tobytes()


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"kind": "disc", "edge": 0.2}, "at most 0.125"),
        ({"kind": "disc", "edge": 1e-4}, "vertices, allowed: at most 1000000"),
        ({"kind": "solid", "shape": "ball", "edge": 0.01}, "vertices, allowed: at most 1000000"),
        ({"kind": "shell", "shape": "cube", "edge": 0.1}, "'ball', 'torus' or 'starfish'"),
        ({"kind": "disc", "edge": 0.1, "hole": 0.95}, "less than or equal to 0.9"),
    ],
)
def test_faulty_shapes_are_refused_before_anything_is_made(entry, message):
    with pytest.raises(ValidationError, match=message):
        MESH.validate_python(entry)


@pytest.mark.parametrize("entry", [
    {"kind": "disc", "edge": 0.05, "hole": 0.0},
    {"kind": "shell", "shape": "ball", "edge": 0.05},
    {"kind": "solid", "shape": "ball", "edge": 0.1},
])  # fmt: skip
def test_no_more_vertices_than_expected_and_fewer_when_coarsened(entry, tmp_path):
    config = MESH.validate_python(entry)
    mesh = config.build(tmp_path)
    assert 0.5 < mesh.vertices / config.expected(config.extent / config.edge) <= 1.0
    coarse = config.coarsened(0.5)
    assert coarse.edge == min(2.0 * config.edge, 0.125)
    assert coarse.build(tmp_path).vertices < mesh.vertices
    assert coarse.identifier != config.identifier
