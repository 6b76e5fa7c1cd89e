"""Irregular mesh files: what is refused, and the rules by which the rest is taken."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from pdrom.core.errors import DegenerateElementError, MeshError
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.generators import bar, cloth
from pdrom.model.mesh.types import Mesh
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene, SceneConfig

SHEET, BAR = cloth(3, 3, "xz"), bar(3, 2, 2)


def read(folder: Path, points: np.ndarray, **cells: np.ndarray) -> Mesh:
    """The mesh of a file with these points and cells."""
    meshio.Mesh(points, list(cells.items())).write(folder / "mesh.vtu")
    return MeshFile(kind="file", path="mesh.vtu").build(folder)


def fin(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A third triangle on an inner edge of the sheet."""
    tip = points.mean(axis=0) + np.array([0.0, 0.5, 0.0])
    return np.vstack([points, tip]), np.vstack([SHEET.triangles, [0, 4, len(points)]])


@pytest.mark.parametrize(
    ("points", "triangles", "message"),
    [
        (np.vstack([SHEET.points, [9, 9, 9]]), SHEET.triangles, "1 vertices in no element"),
        (SHEET.points, np.vstack([SHEET.triangles, SHEET.triangles[3]]), "8 .* repeats triangle 3"),
        (SHEET.points, np.vstack([SHEET.triangles, SHEET.triangles[3][::-1]]), "repeats triangle"),
        (*fin(SHEET.points), r"edge \[0, 4\] belongs to 3 triangles"),
        (SHEET.points, np.vstack([SHEET.triangles, [0, 0, 1]]), "names a vertex twice"),
    ],
)
def test_what_is_refused(tmp_path, points, triangles, message):
    with pytest.raises((MeshError, DegenerateElementError), match=message):
        read(tmp_path, points, triangle=triangles)


def test_a_tetrahedron_of_negative_volume_is_turned(tmp_path):
    cells = BAR.tetrahedra.copy()
    cells[1] = cells[1][[1, 0, 2, 3]]
    corner = (mesh := read(tmp_path, BAR.points, tetra=cells)).points[mesh.tetrahedra]
    assert (np.linalg.det(corner[:, 1:] - corner[:, :1]) > 0.0).all()
    assert np.array_equal(np.sort(mesh.tetrahedra, axis=1), np.sort(BAR.tetrahedra, axis=1))


def two_sheets(joined: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of two sheets: apart, or with one corner in common."""
    other = SHEET.points + (1.0 if joined else 1.5) * np.array([1.0, 0.0, 1.0])
    number = np.arange(9, 18)
    if joined:  # the last vertex of the first sheet is the first of the second
        other, number = other[1:], np.arange(8, 17)
    return np.vstack([SHEET.points, other]), np.vstack([SHEET.triangles, number[SHEET.triangles]])


@pytest.mark.parametrize("joined", [False, True], ids=["two components", "joined in one vertex"])
@pytest.mark.parametrize("effect", ["spring", "strain", "bending"])
def test_parts_without_a_common_edge_are_taken(tmp_path, joined, effect):
    """They rest where nothing pulls, and move where something does."""
    points, triangles = two_sheets(joined)
    mesh = read(tmp_path, points, triangle=triangles)
    entry = {"effect": effect, "weight": 10.0}
    settings = {"name": "parts", "title": "Parts", "mesh": {"kind": "file", "path": "mesh.vtu"}}
    for effects, still in (([entry], True), ([entry, {"effect": "gravity"}], False)):
        config = SceneConfig.model_validate({**settings, "frames": 4, "effects": effects})
        moved = trajectory(Scene.build(config, mesh))[-1] - mesh.points
        assert np.isfinite(moved).all()
        assert (np.abs(moved).max() < 1e-12) == still
