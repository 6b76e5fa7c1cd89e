"""Runs with bases of round-off: the perturbed axes, the modes, and how the runs end."""

import numpy as np
import pandas as pd
import pytest

from pdrom.core.store import write_hdf5
from pdrom.reduction.method import load_methods
from pdrom.view.read import rerun_infos
from places import ROOT
from study.experiments import repetitions as module
from study.pipeline.scenes import Coarsen, load_bound_scene

METHODS = load_methods(ROOT / "config" / "methods.yaml")


@pytest.fixture(scope="module")
def fall():
    """The falling sheet, coarse and short."""
    return load_bound_scene(ROOT, "bend_fall", Coarsen(resolution=0.4, frames=0.4))


def test_a_flat_mesh_may_keep_its_plane(fall):
    assert module.kinds(fall) == (module.ALL, module.PLANE, module.VERTEX)
    curved = load_bound_scene(ROOT, "bend_curved", Coarsen(resolution=0.4))
    assert module.kinds(curved) == (module.ALL,)
    every, plane, vertex = (
        module.roundoff_field(fall, axes, 1e-15, 1) for axes in module.kinds(fall)
    )
    np.testing.assert_array_equal(plane[:, :2], every[:, :2])
    np.testing.assert_array_equal(vertex[:, :2], every[:, :2])
    assert not plane[:, 2].any()
    assert np.count_nonzero(vertex[:, 2]) == 1
    assert every[:, 2].all()


def test_the_joint_selection_fails_where_an_axis_carries_nothing(fall, tmp_path):
    """Without noise in an axis the system of that axis is singular; with noise it is not."""
    asked = module.NoiseRuns(sizes=(2, 5, 99), repetitions=2)
    methods = {name: METHODS[name] for name in ("deim-joint", "published")}
    runs = tmp_path / "noise.h5"
    with write_hdf5(runs) as file:
        rows = module.noisy_runs(fall.changed(frames=22), "bending", asked, methods, 100.0, file)
    table = pd.DataFrame(rows)
    assert len(table) == 3 * 2 * 2 * 3
    beyond = table.r == 99
    assert (table.frames[beyond] == 0).all()
    assert (table["rank"] < 99).all()
    singular = (table.noisy_axes == module.PLANE) & (table.method == "deim-joint") & ~beyond
    assert np.isinf(table.gain[singular]).all()
    assert (table.blowup_frame[singular] == 0).all()
    runs_through = table.noisy_axes.isin((module.ALL, module.PLANE)) & ~singular & ~beyond
    assert (table.relative_error[runs_through] < 1e-10).all()
    drawn = [rerun_infos(runs, f"{axes}/deim-joint") for axes in module.kinds(fall)]
    assert [[(i.r, i.marked) for i in infos] for infos in drawn] == 3 * [
        [(2, False), (5, False), (99, True)]
    ]
    joint = table[(table.method == "deim-joint") & ~beyond]
    for axes, infos in zip(module.kinds(fall), drawn, strict=True):
        starts = joint[joint.noisy_axes == axes].groupby("seed").frames.apply(list)
        ends = [info.entries - 1 for info in infos if not info.marked]
        assert ends == next((s for s in starts if len(set(s)) > 1), starts.iloc[0])
