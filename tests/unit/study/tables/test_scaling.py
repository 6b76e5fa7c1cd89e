"""Cost against mesh size: exact power laws, and a real measurement on two small meshes."""

import numpy as np
import pandas as pd
import pytest

from pdrom.reduction.method import MethodSpec
from places import ROOT
from study.artifact.paths import File
from study.experiments.scaling import Options, Sized, SizedBreakEven
from study.experiments.scaling import scaling as experiment
from study.pipeline.scenes import read_scene
from study.tables.break_even import CURVE, breakeven
from study.tables.scaling import scaling
from study.tables.scaling_fit import QUANTITIES, scaling_fit

SPEC = MethodSpec(title="block DEIM", centring="affine", rows="element")
JOINT = MethodSpec(title="joint DEIM", centring="affine", rows="joint")


def power_laws(exponents, sizes=(100, 1000, 10000)):
    columns = {q: 0.25 * np.power(sizes, e) for q, e in zip(QUANTITIES, exponents, strict=True)}
    return pd.DataFrame({"scene": "a", "method": "fom", "threads": 1, "vertices": sizes, **columns})


def test_exponents_of_exact_power_laws():
    exponents = [0.0, 1.0, 1.5, 2.0, 0.3]
    fitted = scaling_fit(power_laws(exponents))
    assert fitted.quantity.tolist() == list(QUANTITIES)
    assert fitted.exponent.tolist() == pytest.approx(exponents, abs=1e-12)
    assert fitted.points.tolist() == [3] * 5


@pytest.mark.parametrize("sizes", [(100,), (100, 1000)])
def test_fewer_than_three_sizes_have_no_exponent(sizes):
    assert scaling_fit(power_laws([1.0] * 5, sizes)).empty


def test_what_was_not_measured_has_no_exponent():
    table = power_laws([1.0] * 5)
    table["memory_mb"] = [0.0, 0.0, 4.0]
    fit = scaling_fit(table).set_index("quantity").loc["memory_mb"]
    assert pd.isna(fit.exponent)
    assert fit.points == 1


def test_no_scene_gives_empty_tables():
    table = scaling([])
    assert tuple(table.columns) == scaling.column_names
    assert tuple(scaling_fit(table).columns) == scaling_fit.column_names


@pytest.mark.parametrize("name", ["strain_oop", "bar_release"])
def test_every_size_is_measured(tmp_path, name):
    scene = read_scene(ROOT, name).coarsened(0.4, 1.0)
    alone = SizedBreakEven(sizes=(2, 3, 1000), training_frames=9, repeats=2)
    settings = Options(
        scene=scene,
        scaled_methods={"block-deim": SPEC, "deim-joint": JOINT},
        scaling=Sized(r=4, k=5, training_frames=8, frames=1, repeats=2, breakeven=alone),
        solver="supernodal",
    )
    outputs = {}
    for factor in (0.7, 1.0):
        paths = {k: str(tmp_path / f"{k}{factor}") for k in ("iterations", "breakeven", "effects")}
        files = {k: File(path, {"factor": f"{factor:g}"}) for k, path in paths.items()}
        experiment(sources=[], settings=settings, **files)
        outputs[factor] = paths
    sizes = [scene.mesh.coarsened(f).build(ROOT).vertices for f in outputs]
    _check_iterations(scaling([File(made["iterations"], {}) for made in outputs.values()]), sizes)
    _check_alone(breakeven([File(made["breakeven"], {}) for made in outputs.values()], []), sizes)


def _check_iterations(table: pd.DataFrame, sizes: list[int]) -> None:
    assert table.method.tolist() == 2 * ["fom", "fom", "block-deim", "ecsw"]
    assert table.threads.tolist() == 2 * [1, 2, 1, 1]
    assert table.vertices.tolist() == [n for n in sizes for _ in range(4)]
    assert (table.ms_per_iteration >= table.local_ms + table.global_ms).all()
    assert table.local_share.between(0.0, 1.0).all()
    fom, reduced = table[table.method == "fom"], table[table.method != "fom"]
    assert (fom[fom.threads == 1].factorisation_ms > 0.0).all()
    assert (fom[fom.threads == 1].speedup == 1.0).all()
    own = fom[fom.threads == 1].set_index("vertices").local_ms
    np.testing.assert_allclose(table.local_speedup * table.local_ms, table.vertices.map(own))
    assert fom.elements_sampled.isna().all()
    assert (reduced.elements_sampled <= reduced.elements).all()


def _check_alone(table: pd.DataFrame, sizes: list[int]) -> None:
    assert (table.local_ms > 0.0).all()
    assert (table[["full_ms", "solve_ms", "lift_ms"]] > 0.0).all(axis=None)
    curves = table.groupby(CURVE)
    assert len(curves) == 2 * 2 * 2
    assert [g.vertices.iloc[0] for _, g in curves if g.threads.iloc[0] == 1] == 2 * sizes
    for _, curve in curves:
        # the largest size is the numerical rank, not what was asked for
        assert curve.r.tolist()[:2] == [2, 3]
        assert 3 < curve.r.iloc[-1] < 1000
