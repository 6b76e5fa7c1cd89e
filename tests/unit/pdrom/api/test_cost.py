"""What accuracy costs: the table of settings, coarser meshes and models, and its refusals."""

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


def sheet(*effects: dict, **settings: object):
    own = effects or (GRAVITY, LEFT, SPRING)
    return make_scene(*own, **{"mesh": SHEET, "frames": 8, **settings})


MODULE = import_module("pdrom.api.cost")  # the package's attribute of this name is the function


@pytest.fixture(autouse=True)
def counting(monkeypatch):
    """A time is the number of vertices times iterations, so that tests do not depend on clocks."""

    def counted(variants, repeats):
        return [1e-3 * len(one.start.positions) * one.loop.iterations for one in variants], True

    monkeypatch.setattr(MODULE, "timed", counted)


@pytest.fixture(scope="module")
def model() -> api.Model:
    return api.train(api.run(sheet()), modes=10)


def test_a_table_has_settings_of_own_and_coarser_grids_and_of_a_model_cheapest_first(model):
    seen: list[tuple[str, int]] = []

    def progress(name, frames):
        seen.append((name, frames))
        return lambda frame, report: None

    table = api.cost(sheet(iterations=4), models=[model], progress=progress)
    assert table.columns.tolist() == [
        "setting", "method", "iterations", "vertices", "position_error", "deformation_error", "ms",
        "best",
    ]  # fmt: skip
    assert table.ms.is_monotonic_increasing
    by_name = table.set_index("setting")
    assert {"1 iteration", "4 iterations", "10 iterations, Anderson"} <= {*by_name.index}
    assert {"2 iterations on 16 vertices", "5 iterations, Anderson on 16 vertices"} <= {
        *by_name.index
    }
    assert by_name.iterations.isna()["model 1, converged"]
    assert by_name.iterations["model 1, 5 iterations"] == 5
    errors = by_name.position_error
    assert errors["1 iteration"] > errors["5 iterations"] > errors["10 iterations, Anderson"] > 0.0
    assert errors["model 1, converged"] < errors["model 1, 5 iterations"]
    assert (by_name.deformation_error > 0.0).all()
    found = table[table.best]
    assert (found.position_error.diff().dropna() < 0.0).all()
    assert len(found) > 2
    assert table.attrs["frames"] == 8
    assert ("test, converged", 8) in seen
    figure = plot_cost(table)
    (ax,) = figure.axes
    assert len(ax.texts) == len(table)
    assert "model 1" in [text.get_text() for text in figure.legends[0].texts]


def test_three_meshes_estimate_the_error_of_the_finest():
    fine = sheet(mesh=SHEET | {"rows": 13, "columns": 13}, frames=20)
    runs = [converged_run(fine, 1e-6, 20_000)]
    meshes = coarser.grids(fine, (0.5, 0.25))
    expected = coarser.error_of_mesh(*runs, meshes, [m.converged(1e-6, 20_000) for m in meshes])
    found = api.cost(fine).attrs["mesh_error"]
    assert found == pytest.approx(expected, rel=1e-3)
    one = api.cost(fine, coarser=[cloth(4, 4, "xz")])
    assert one.attrs["mesh_error"] is None
    assert set(one.vertices) == {169, 16}


def test_a_rigid_body_has_no_deformation_error_and_a_body_at_rest_none():
    rigid = api.cost(sheet(GRAVITY, SPRING))
    assert rigid.deformation_error.isna().all()
    assert (rigid.position_error < 1e-9).all()
    still = api.cost(sheet(LEFT, SPRING))
    assert still.position_error.isna().all()
    assert still[still.best].setting.str.contains("on 16 vertices").all()


def test_a_setting_that_blows_up_is_never_best(monkeypatch):
    monkeypatch.setattr("pdrom.reduction.settings.BLOWUP_EXTENT", 0.1)
    table = api.cost(sheet())
    assert np.isinf(table[["position_error", "deformation_error"]]).all(axis=None)
    assert not table.best.any()
    assert len(plot_cost(table).axes[0].texts) == 0


def test_a_scene_that_does_not_converge_is_refused(monkeypatch):
    monkeypatch.setattr(MODULE, "EVALUATIONS", 2)
    with pytest.raises(SolverError, match="scene 'test': a frame does not converge"):
        api.cost(sheet())


def test_files_are_read_as_the_mesh_of_the_scene(tmp_path, model):
    fine, coarse = cloth(7, 5, wave=0.25), cloth(4, 3, wave=0.25)
    for name, mesh in (("fine", fine), ("coarse", coarse)):
        made = meshio.Mesh(1e3 * mesh.points, [("triangle", mesh.triangles)])
        meshio.write(tmp_path / f"{name}.obj", made)
    path = tmp_path / "coarse.obj"
    keys = {"frames": 3, "effects": [GRAVITY, SPRING], "folder": tmp_path}
    scene = api.build_scene(mesh={"kind": "file", "path": "fine.obj", "scale": 1e-3}, **keys)
    assert set(api.cost(scene, [path]).vertices) == {35, 12}
    unscaled = api.build_scene(mesh=(fine.points, fine.triangles), **keys)
    with pytest.raises(ConfigurationError, match="in another unit of length") as error:
        api.cost(unscaled, [path])
    assert str(error.value).startswith(f"{path}: scene 'scene': the coarser mesh ends ")


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"coarser": ["none.obj"]}, "none.obj: no such mesh file"),
        ({"coarser": "none.obj"}, "coarser = 'none.obj': a list is required"),
        ({"coarser": [cloth(9, 9, "xz")]}, "not fewer than 36 vertices"),
        ({"models": ["none.h5"]}, "none.h5: no such file"),
        ({"progress": None}, "progress = None: a function of two arguments is required"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_refused_before_anything_runs(given, fault):
    with pytest.raises(PdromError, match=fault):
        api.cost(sheet(), **given)


def test_a_model_of_another_mesh_is_refused(model):
    with pytest.raises((ConfigurationError, SceneError), match="mesh"):
        api.cost(sheet(mesh=SHEET | {"rows": 7}), models=[model])
