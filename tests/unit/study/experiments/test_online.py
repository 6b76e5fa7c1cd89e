"""Experiment `online`: the rows of one scene."""

from functools import partial

import numpy as np
import pandas as pd
import pytest

from builders import TOP, make_scene
from pdrom.core.errors import PdromError
from pdrom.core.provenance import made_by
from pdrom.core.store import read_table
from pdrom.model.held_out import MOTIONS
from pdrom.model.mesh.types import save_mesh
from pdrom.model.scene import SceneConfig
from pdrom.reduction.deviations import ERRORS
from study.artifact.paths import File
from study.experiments import frame_times as timing
from study.experiments import subspaces as experiment
from study.experiments.kit.measurement import Processes, in_processes
from study.experiments.subspaces import COLUMNS, LARGE_COLUMNS, Hrpd, LargeModels
from study.tables.effects_cost import frame_times, online, speedups

JUDGED = ("motion", "horizon_frame", "playback_error", *ERRORS)
NO_RERUNS = pd.DataFrame(columns=[*COLUMNS, *JUDGED])
ONCE = Processes(frames=3, repeats=1, processes=1)
CHANGES = {"reduce": {"spring": {"train": 5}}, "held_out": {"kick": 0.5}}


@pytest.fixture(scope="module")
@made_by("online", {}, "c0de")
def written(tmp_path_factory):
    gravity = {"effect": "gravity", "acceleration": [0.0, 0.0, -9.81]}
    effects = ({"effect": "spring", "weight": 1e5}, gravity, TOP)
    scene = make_scene(*effects, mesh={"kind": "cloth", "rows": 8, "columns": 7}, frames=10)
    config = SceneConfig.model_validate(scene.config.model_dump(mode="json") | CHANGES)
    path = tmp_path_factory.mktemp("online") / "scene.csv"
    asked = LargeModels(
        bases=("pod", "skinning"), sizes=(3,), tolerances=(0.3, 1e-2), hrpd=Hrpd(sizes=(3,))
    )
    models = path.with_suffix(".h5")
    out, stored = File(str(path), {"scene": "test"}), File(str(models), {})
    experiment.online([], config, asked, out=out, models=stored)
    mesh, *times = (File(str(path.with_name(n)), {}) for n in ("mesh.h5", "times.csv", "s.csv"))
    save_mesh(scene.mesh, mesh.path)
    # as a scene of the study and as a large scene
    named = (timing.NamedScene(scene=config.name, config=config),)
    settings = timing.Options(
        frame_times=ONCE, timed_scenes=named, large_scenes=named, subspace_cases=(),
        projection_cases=(), projection_methods={},
    )  # fmt: skip
    none = {key: [] for key in ("subspaces", "bases", "samplings", "snapshots")}
    timing.frame_times(settings, *times, meshes=[mesh], large=[stored], **none)
    return scene, path, times[0]


def test_every_model_has_its_errors_and_its_time_in_a_fresh_process(written):
    scene, path, times = written
    rows, timed = read_table(path), read_table(times.path)
    assert rows.columns.tolist() == LARGE_COLUMNS
    assert rows.motion.unique().tolist() == ["train", *MOTIONS]
    train = rows[rows.motion == "train"]
    assert train.position_basis.tolist() == ["pod", "pod", "pod", "skinning"]
    assert train.method.tolist() == ["ecsw-3e-01", "ecsw-1e-02", "hrpd", "hrpd"]
    assert train.tau.tolist()[:2] == [0.3, 1e-2]
    table = online(rows, timed, frame_times(timed))
    assert len(table) == len(train)
    assert (table.vertices == 56).all()
    assert (table.elements == scene.groups[0].elements).all()
    assert (table.elements_sampled > 0).all()
    assert (table.elements_sampled <= table.elements).all()
    for column in ("relative_error_train", "relative_error_heldout"):
        assert table[column].between(1e-6, 1.0).all()
    assert (table.relative_error_heldout_high > table.relative_error_heldout).all()
    # the test trajectory starts with a kick that the training does not contain
    assert (table.relative_error_heldout > table.relative_error_train).any()

    assert timed.role.tolist() == ["full", "control", *4 * ["reduced"]]
    assert (timed.ms_per_frame > 0.0).all()
    assert (timed.vertices == scene.mesh.vertices).all()
    np.testing.assert_allclose(table.ms_per_iteration, table.ms_per_frame / 10)
    full = timed.ms_per_frame[timed.role == "full"].item()
    np.testing.assert_allclose(table.speedup, full / table.ms_per_frame)
    # the files contain the same models
    assert table.ms_per_frame.tolist() == timed.ms_per_frame[2:].tolist()
    none = pd.DataFrame()
    quoted = speedups(timed, frame_times(timed), none, none, rows, NO_RERUNS)
    for column, own in (("error_train", "train"), ("error_heldout_high", "heldout_high")):
        assert quoted[column].tolist() == table[f"relative_error_{own}"].tolist()
    assert (quoted.reduction_s > 0.0).all()


def test_a_failed_process_is_reported(written):
    missing = partial(timing.variants, written[0], [({}, None)], 1)
    with pytest.raises(PdromError, match="'NoneType' object has no attribute"):
        in_processes([missing], ONCE)


def test_a_diverged_trajectory_has_an_infinite_error(written):
    rows, timed = (read_table(path) for path in (written[1], written[2].path))
    chosen = rows[(rows.method == "ecsw-1e-02")].copy()
    chosen["relative_error"] = [0.1, 0.2, None, 0.3]
    chosen["blowup_frame"] = [None, None, 3, None]
    (row,) = online(chosen, timed, frame_times(timed)).itertuples()
    found = (row.relative_error_heldout, row.relative_error_heldout_high)
    assert (row.relative_error_train, *found) == (0.1, 0.3, np.inf)
