"""Degenerate elements are told from slivers, whatever their place, direction and size."""

import numpy as np
import pytest
from hypothesis import given

from pdrom.core.errors import DegenerateElementError
from pdrom.model.mesh.checks import check_mesh
from pdrom.model.mesh.types import Mesh
from strategies import cells, wild_meshes
from study.experiments.hard_cases.case import build

EMPTY = np.empty((0, 4), dtype=np.int32)


def one_cell(corners: np.ndarray) -> Mesh:
    indices = np.arange(len(corners), dtype=np.int32)[None]
    if len(corners) == 3:
        return Mesh(corners, indices)
    return Mesh(corners, EMPTY[:, :3], indices)


@given(corners=cells(3, 0.0) | cells(4, 0.0))
def test_degenerate_cells_are_refused(corners):
    """Collinear and coplanar up to rounding of the corners."""
    with pytest.raises(DegenerateElementError, match="has zero"):
        check_mesh(one_cell(corners), "mesh")


@given(corners=cells(3, 1e-9) | cells(4, 1e-9))
def test_slivers_are_not_refused(corners):
    check_mesh(one_cell(corners), "mesh")


@given(corners=cells(4, 0.5))
def test_size_has_no_say(corners):
    for size in (1e-100, 1e100):
        check_mesh(one_cell(size * corners), "mesh")


@given(mesh=wild_meshes("sheet"))
@pytest.mark.parametrize("effect", ["spring", "strain", "bending"])
def test_wild_sheets_rest_in_themselves(effect, mesh):
    """S at rest projects on itself: the elastic force vanishes for any mesh."""
    _rests(build(mesh, {"effect": effect, "weight": 1.0}, frames=1))


@given(mesh=wild_meshes("bar"))
@pytest.mark.parametrize("effect", ["spring", "tetrahedron_strain", "deformation_gradient"])
def test_wild_bars_rest_in_themselves(effect, mesh):
    _rests(build(mesh, {"effect": effect, "weight": 1.0}, frames=1))


def _rests(scene) -> None:
    group, points = scene.groups[0], scene.mesh.points
    group.begin_frame(points)
    d = group.S @ points
    scale = np.abs(abs(group.S) @ np.abs(points)).max()
    assert np.abs(d - group.project(points)).max() <= 1e-12 * scale
