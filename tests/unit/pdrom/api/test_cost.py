"""The table of costs against errors of settings, coarser meshes and models, and its errors."""

from importlib import import_module

import meshio
import numpy as np
import pytest

from builders import GRAVITY, LEFT, make_scene
from pdrom import api
from pdrom.api.pictures import plot_cost
from pdrom.core.errors import ConfigurationError, PdromError, SceneError, SolverError
from pdrom.model import coarser
from pdrom.model.mesh.generators import cloth
from pdrom.model.runs import converged_run

SPRING = {"effect": "spring", "weight": 1e4}
SHEET = {"kind": "cloth", "rows": 6, "columns": 6, "plane": "xz"}
MODULE = import_module("pdrom.api.cost")  # the package's attribute of this name is the function


def sheet(*effects: dict, size: int = 6, frames: int = 8, **settings: object):
    own, mesh = effects or (GRAVITY, LEFT, SPRING), SHEET | {"rows": size, "columns": size}
    return make_scene(*own, mesh=mesh, frames=frames, **settings)


@pytest.fixture(autouse=True)
def counting(monkeypatch):
    """A time is the number of vertices times iterations, so that tests do not depend on clocks."""

    def counted(variants, repeats):
        return [1e-3 * len(one.start.positions) * one.loop.iterations for one in variants], True

    monkeypatch.setattr(MODULE, "timed", counted)


def test_a_cost_table_lists_settings_of_all_grids_and_of_a_model_the_fastest_first(tmp_path):
    model = api.train(api.run(sheet()), modes=10)
    table = api.cost(sheet(iterations=4), models=[model])
    assert table.columns.tolist() == [
        "setting", "method", "iterations", "vertices", "position_error", "deformation_error", "ms",
        "best",
    ]  # fmt: skip
    assert table.ms.is_monotonic_increasing
    rows = table.set_index("setting")
    expected = {"1 iteration", "4 iterations", "10 iterations, Anderson"}
    assert expected | {"5 iterations, Anderson on 16 vertices"} <= {*rows.index}
    assert rows.iterations.isna()["model 1, converged"]
    assert rows.iterations["model 1, 5 iterations"] == 5
    errors, best = rows.position_error, table[table.best]
    assert errors["1 iteration"] > errors["5 iterations"] > errors["10 iterations, Anderson"] > 0.0
    assert errors["model 1, converged"] < errors["model 1, 5 iterations"]
    assert (rows.deformation_error > 0.0).all()
    assert (best.position_error.diff().dropna() < 0.0).all()
    assert len(best) > 2
    figure = plot_cost(table)
    assert len(figure.axes[0].texts) == len(table)
    assert {"model 1", "16 vertices"} <= {text.get_text() for text in figure.legends[0].texts}
    model.save(tmp_path / "own.h5")
    with pytest.raises(ConfigurationError, match=f"^{tmp_path}/own.h5: scene 'test': its mesh"):
        api.cost(sheet(size=7), models=[tmp_path / "own.h5"])


def test_two_coarser_meshes_estimate_the_discretisation_error():
    fine, tolerance = sheet(size=13, frames=20), (1e-6, 20_000)
    meshes = coarser.grids(fine, (0.5, 0.25))
    runs = [mesh.converged(*tolerance) for mesh in meshes]
    expected = coarser.error_of_mesh(converged_run(fine, *tolerance), meshes, runs)
    assert api.cost(fine).attrs["mesh_error"] == pytest.approx(expected, rel=1e-3)
    one = api.cost(fine, coarser=[cloth(4, 4, "xz")])
    assert one.attrs["mesh_error"] is None
    assert set(one.vertices) == {169, 16}


def test_a_rigid_body_has_no_deformation_error_a_diverged_one_an_infinite_error(monkeypatch):
    assert api.cost(sheet(GRAVITY, SPRING)).deformation_error.isna().all()
    with pytest.raises(SceneError, match="there is nothing to reduce"):
        api.cost(sheet(LEFT, SPRING))
    monkeypatch.setattr("pdrom.reduction.settings.BLOWUP_EXTENT", 0.1)
    table = api.cost(sheet())
    assert np.isinf(table[["position_error", "deformation_error"]]).all(axis=None)
    assert not table.best.any()
    assert len(plot_cost(table).axes[0].texts) == 0


def test_a_coarser_grid_on_which_an_effect_is_impossible_is_left_out(caplog):
    place = sheet(size=13).mesh.points[6 + 13]  # no vertex of the grid with a quarter of the cells
    near = np.array([0.01, 1.0, 0.01])
    box = {"kind": "box", "lower": list(place - near), "upper": list(place + near)}
    table = api.cost(sheet(GRAVITY, SPRING, {"effect": "pins", "select": box}, size=13, frames=2))
    assert set(table.vertices) < {169, 49, 25, 16}
    assert "of the cells along a side: scene 'test', effect 'pins': selection" in caplog.text


def test_mesh_files_are_read_with_the_settings_of_the_scene(tmp_path):
    fine, coarse = cloth(7, 5, wave=0.25), cloth(4, 3, wave=0.25)
    for name, mesh in (("fine", fine), ("coarse", coarse)):
        made = meshio.Mesh(1e3 * mesh.points, [("triangle", mesh.triangles)])
        meshio.write(tmp_path / f"{name}.obj", made)
    path, keys = tmp_path / "coarse.obj", {"frames": 3, "effects": [GRAVITY, SPRING]}
    mesh = {"kind": "file", "path": "fine.obj", "scale": 1e-3}
    assert set(api.cost(api.build_scene(tmp_path, mesh, **keys), [path]).vertices) == {35, 12}
    unscaled = api.build_scene(mesh=(fine.points, fine.triangles), **keys)
    with pytest.raises(SceneError, match=f"^{path}: scene 'scene': .* its unit"):
        api.cost(unscaled, [path])


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"coarser": "none.obj"}, "coarser = 'none.obj': a list is required"),
        ({"coarser": [cloth(9, 9, "xz")]}, "required are fewer than 36 vertices"),
        ({"progress": None}, "progress = None: a function of two arguments is required"),
    ],
)
def test_wrong_arguments_and_frames_that_do_not_converge_are_refused(given, fault, monkeypatch):
    with pytest.raises(PdromError, match=fault):
        api.cost(sheet(), **given)
    monkeypatch.setattr("pdrom.api.training.EVALUATIONS", 2)
    with pytest.raises(SolverError, match="scene 'test': a frame does not converge"):
        api.cost(sheet())
