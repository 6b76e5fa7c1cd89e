"""Drawn elements, residuals of the selections, and the runs that figures read."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from pdrom.core.errors import StorageError
from pdrom.model.mesh.generators import bar, cloth
from pdrom.reduction.sampling.deim import deim_entries
from pdrom.view.camera import Camera
from study.artifact.paths import RERUNS, TRAIN
from study.figures.kit.elements import element_map, magnitudes, signed_entry
from study.figures.kit.read import choose_ranks, positions_at, rerun_infos
from study.figures.sampling import iterations

from .conftest import BLOWN_UP, BLOWUP_FRAME


@pytest.mark.parametrize(
    ("group", "mesh", "kind"),
    [
        ("bending", cloth(6, 5), "vertex"),
        ("spring", cloth(6, 5), "edge"),
        ("spring", bar(4, 3, 3), "edge"),
        ("strain", cloth(6, 5), "triangle"),
        ("deformation_gradient", bar(4, 3, 3), "tetrahedron"),
    ],
)
def test_elements_are_drawn_where_they_lie(group, mesh, kind):
    count = {"vertex": 4 * 3, "edge": len(mesh.edges()), "triangle": len(mesh.triangles),
             "tetrahedron": len(mesh.tetrahedra)}[kind]  # fmt: skip
    elements = element_map(group, mesh, count, "file")
    assert elements.kind == kind
    assert elements.centres(mesh.points).shape == (count, 3)
    ax = Figure().subplots()
    elements.draw(ax, mesh.points, np.linspace(0, 1, count), Camera(), magnitudes())
    assert ax.collections
    with pytest.raises(StorageError, match="the mesh has"):
        element_map(group, mesh, count + 1, "file")


def test_boundary_triangles_have_the_value_of_their_tetrahedron():
    mesh = bar(4, 3, 3)
    elements = element_map("tetrahedron_strain", mesh, len(mesh.tetrahedra), "file")
    owner = elements.face_values(np.arange(len(mesh.tetrahedra)))
    for triangle, tetrahedron in zip(mesh.triangles, owner, strict=True):
        assert set(triangle) < set(mesh.tetrahedra[tetrahedron])


def test_vertex_values_colour_the_adjacent_faces():
    mesh = cloth(4, 4)
    elements = element_map("bending", mesh, 4, "file")
    values = elements.face_values(np.array([1.0, 1.0, 1.0, 1.0]))
    touched = np.isin(mesh.triangles, elements.cells[:, 0]).any(axis=1)
    assert np.allclose(values[touched], 1.0)
    assert np.isnan(values[~touched]).all()


def test_the_signed_entry_is_the_largest():
    vector = np.zeros((4, 6))
    vector[2, 4], vector[1, 0], vector[3, 4] = -3.0, 2.0, 1.0
    values, words = signed_entry(vector.ravel(), 2)
    assert values.tolist() == [0.0, 0.0, -3.0, 1.0]
    assert words == "y, row 2"
    assert signed_entry(vector.ravel(), 1)[1] == "y"


def test_drawn_residuals_are_those_of_deim():
    V = np.linalg.qr(np.random.default_rng(3).standard_normal((60, 6)))[0]
    entries = deim_entries(V)
    for step in iterations(V, entries, 2, 6):
        coefficients = np.zeros(0)
        picked = entries[: step.k - 1]
        if len(picked):
            coefficients = np.linalg.solve(V[picked, : step.k - 1], V[picked, step.k - 1])
        residual = V[:, step.k - 1] - V[:, : step.k - 1] @ coefficients
        assert step.entry == np.argmax(np.abs(residual))
        assert np.allclose(step.magnitude, np.abs(residual.reshape(-1, 6)).max(axis=1))
        assert step.newest == step.entry // 6
        assert list(step.earlier) == [e // 6 for e in picked]


def test_entries_outside_the_basis_are_refused():
    with pytest.raises(StorageError, match="do not fit"):
        iterations(np.eye(12)[:, :2], np.array([3, 12]), 2, 2)


def test_drawn_instants_may_be_shares_of_the_first_frames(study):
    path = study.path(TRAIN, "spring_twist")
    frames, positions = positions_at(path, (0.5, 1.0), end=10)
    assert frames == [5, 10]
    whole, everything = positions_at(path, (0.25, 0.5, 1.0))
    assert whole == [5, 10, 20]
    assert (positions == everything[:2]).all()
    assert positions_at(path, (1.0,), end=99)[0] == [20]


def test_runs_are_read_only_up_to_their_last_finite_frame(study):
    scene, method, r = BLOWN_UP
    path = study.path(RERUNS, scene, "spring", method)
    infos = {info.r: info for info in rerun_infos(path)}
    assert list(infos) == [6, 10, 14, 20]
    assert infos[14].full
    assert infos[20].marked
    entry, positions = infos[r].at(15)
    assert entry == BLOWUP_FRAME - 1
    assert np.isfinite(positions).all()
    assert [i.r for i in choose_ranks(list(infos.values()), ("full", 14, 6, 99))] == [14, 6]
    test = next(info for info in rerun_infos(path, "heldout") if info.r == 6)
    shown, same = (info.at(11) for info in (test, infos[6]))
    assert shown[0] == 8
    np.testing.assert_array_equal(shown[1], infos[6].at(8)[1])
    assert same[0] == 11
    assert choose_ranks(list(infos.values()), (99,)) == list(infos.values())
