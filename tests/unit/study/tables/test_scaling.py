"""Cost against mesh size: exact power laws, and a real measurement on two small meshes."""

import numpy as np
import pandas as pd
import pytest

from pdrom.reduction.method import MethodSpec
from places import ROOT
from study.artifact.paths import File
from study.experiments.timing import ITERATIONS, Sized, SizedBreakEven, SizedOptions
from study.experiments.timing import scaling as experiment
from study.pipeline.scenes import read_scene
from study.tables.accuracy_cost import CURVE, breakeven
from study.tables.effects_cost import scaling
from study.tables.kit.results import joined

SPEC = MethodSpec(title="block DEIM", centring="affine", rows="element")
JOINT = MethodSpec(title="joint DEIM", centring="affine", rows="joint")


@pytest.mark.parametrize("sizes", [(100,), (100, 1000), (100, 1000, 10000)])
@pytest.mark.parametrize("exponent", [0.0, 1.5])
def test_the_exponent_of_a_power_law_needs_three_sizes(sizes, exponent):
    law = 0.25 * np.power(sizes, exponent)
    rows = pd.DataFrame({"method": "fom", "vertices": sizes, "ms_per_iteration": law})
    row = scaling(rows.assign(scene="a").reindex(columns=ITERATIONS)).iloc[0]
    expected = exponent if len(sizes) == 3 else np.nan
    assert row.exponent == pytest.approx(expected, abs=1e-12, nan_ok=True)
    assert row.meshes == len(sizes)


@pytest.mark.parametrize("name", ["strain_oop", "bar_release"])
def test_every_mesh_size_is_measured(tmp_path, name):
    scene = read_scene(ROOT, name).coarsened(0.4, 1.0)
    alone = SizedBreakEven(sizes=(2, 3, 1000), training_frames=9, repeats=2)
    settings = SizedOptions(
        scene=scene,
        scaled_methods={"block-deim": SPEC, "deim-joint": JOINT},
        scaling=Sized(r=4, k=5, training_frames=8, frames=1, repeats=2, breakeven=alone),
    )
    outputs = {}
    for factor in (0.7, 1.0):
        paths = {k: str(tmp_path / f"{k}{factor}") for k in ("iterations", "breakeven")}
        files = {k: File(path, {"factor": f"{factor:g}"}) for k, path in paths.items()}
        experiment(sources=[], settings=settings, **files)
        outputs[factor] = paths
    sizes = [scene.mesh.coarsened(f).build(ROOT).vertices for f in outputs]
    table = scaling(joined(File(made["iterations"], {}) for made in outputs.values()))
    assert table.method.tolist() == 2 * ["fom", "block-deim", "ecsw"]
    assert table.vertices.tolist() == [n for n in sizes for _ in range(3)]
    assert (table.ms_per_iteration >= table.local_ms + table.global_ms).all()
    np.testing.assert_allclose(table.local_share, table.local_ms / table.ms_per_iteration)
    fom, reduced = table[table.method == "fom"], table[table.method != "fom"]
    assert (fom.speedup == 1.0).all()
    own = table.vertices.map(fom.set_index("vertices").ms_per_iteration)
    np.testing.assert_allclose(table.speedup * table.ms_per_iteration, own)
    assert fom.elements_sampled.isna().all()
    assert (reduced.elements_sampled <= reduced.elements).all()

    table = breakeven([File(made["breakeven"], {}) for made in outputs.values()], [])
    assert (table[["local_ms", "full_ms", "solve_ratio", "lift_ratio"]] > 0.0).all(axis=None)
    curves = [curve for _, curve in table.groupby(CURVE)]
    assert [curve.vertices.iloc[0] for curve in curves] == 2 * sizes
    for curve in curves:
        # the largest size is the numerical rank, not the requested one
        assert curve.r.tolist()[:2] == [2, 3]
        assert 3 < curve.r.iloc[-1] < 1000
