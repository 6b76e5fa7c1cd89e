"""Cost against mesh size: exact power laws, and a real measurement on two small meshes."""

import numpy as np
import pandas as pd
import pytest

from conftest import ROOT
from pdrom.config import Scaling, Study
from pdrom.stages.scaling import scale_scene
from pdrom.tables.columns import COLUMNS
from pdrom.tables.scaling import QUANTITIES, scaling, scaling_fit

SPEC = {"title": "block DEIM", "centring": "affine", "rows": "element"}


def power_laws(exponents, sizes=(100, 1000, 10000)):
    columns = {q: 2.5 * np.power(sizes, e) for q, e in zip(QUANTITIES, exponents, strict=True)}
    return pd.DataFrame({"scene": "a", "method": "fom", "vertices": sizes, **columns})


def test_exponents_of_exact_power_laws():
    exponents = [0.0, 1.0, 1.5, 2.0, 0.3]
    fitted = scaling_fit(power_laws(exponents))
    assert fitted.quantity.tolist() == list(QUANTITIES)
    assert fitted.exponent.tolist() == pytest.approx(exponents, abs=1e-12)
    assert fitted.points.tolist() == [3] * 5


def test_one_size_or_nothing_measured_has_no_exponent():
    table = power_laws([1.0] * 5, sizes=(100,))
    assert scaling_fit(table).empty
    table = power_laws([1.0] * 5)
    table["memory_mb"] = [0.0, 0.0, 4.0]
    assert "memory_mb" not in set(scaling_fit(table).quantity)


def test_no_scene_gives_empty_tables():
    table = scaling([])
    assert tuple(table.columns) == COLUMNS["scaling"]
    assert tuple(scaling_fit(table).columns) == COLUMNS["scaling_fit"]


@pytest.mark.parametrize("name", ["strain_oop", "bar_release"])
def test_every_size_is_measured(tmp_path, name):
    study = Study.load({"scenes": [name], "methods": ["pod"]}, ROOT)
    settings = Scaling(r=4, k=5, training_frames=8, frames=1, repeats=2).model_dump()
    paths = []
    for factor in (0.3, 0.5):
        paths.append(str(tmp_path / f"x{factor}.csv"))
        scale_scene(
            study.scenes[name].model_dump(mode="json"), factor, "block-deim", SPEC, settings,
            "cholespy", str(ROOT), paths[-1],
        )  # fmt: skip
    table = scaling(paths)
    assert tuple(table.columns) == COLUMNS["scaling"]
    assert table.method.tolist() == 2 * ["fom", "block-deim", "ecsw"]
    sizes = [study.scenes[name].mesh.coarsened(f).build(ROOT).vertices for f in (0.3, 0.5)]
    assert table.vertices.tolist() == [n for n in sizes for _ in range(3)]
    assert (table.ms_per_iteration >= table.local_ms + table.global_ms).all()
    assert table.local_share.between(0.0, 1.0).all()
    fom, reduced = table[table.method == "fom"], table[table.method != "fom"]
    assert (fom.factorisation_ms > 0.0).all()
    assert fom.elements_sampled.isna().all()
    assert (reduced.elements_sampled <= reduced.elements).all()
