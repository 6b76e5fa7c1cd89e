"""Files of one scene, of the pipeline's results and of own runs: what they show, and of what."""

import json
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import imageio_ffmpeg
import meshio
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from PIL import Image

from pdrom import api
from pdrom.api.pictures import viewed_scenes
from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import SUBSPACES, TIMINGS
from pdrom.core.store import read_table, write_table
from pdrom.model.scene import SceneConfig
from pdrom.pipeline.contents import labels_of
from pdrom.pipeline.scene_command import scene_order, scene_results
from pdrom.pipeline.study import Study
from pdrom.report.scenes.film import durations
from pdrom.report.scenes.kinds import KINDS, draw
from pdrom.report.scenes.picture import SHOWN, panel_of, shown
from pdrom.report.viewer.runs import ViewedRun, ViewedScene
from pdrom.tables.accuracy_cost import accuracy_cost
from pdrom.tables.effects_contribution import effects_contribution
from pdrom.tables.reduced_reruns import reduced_reruns
from small_scene import NEEDED, SCENE, run_jobs, small_study

PICTURES = ["frames", "error_against_r", "error_against_time"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, str]:
    """A study and its results folder, with everything that the scene's files are made of."""
    root = tmp_path_factory.mktemp("own")
    study, results = small_study(root), str(root / "results")
    run_jobs(study, results, NEEDED, SCENE)
    return study, results


@pytest.fixture(scope="module")
def of_pipeline(finished: tuple[Study, str]) -> ViewedScene:
    """The scene as the pipeline's results have it."""
    study, results = finished
    return scene_results(study, SCENE, results).viewed()


@pytest.fixture(scope="module")
def of_runs(finished: tuple[Study, str]) -> ViewedScene:
    """The same scene, run and reduced by itself; the last run blew up."""
    study, _ = finished
    full = api.run(api.build_scene(study.root, **study.scene(SCENE).model_dump(mode="json")))
    (made,) = viewed_scenes(*(api.reduce(full, "spring", "pod", r) for r in (2, 1)))
    return made


@pytest.fixture(params=["of_pipeline", "of_runs"])
def scene(request: pytest.FixtureRequest) -> ViewedScene:
    """The scene from either source."""
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_drawn_alike_each_time_without_hidden_files(scene, name, tmp_path):
    pdf, png = draw(scene, name, tmp_path)
    assert np.mean(np.any(imread(png)[..., :3] < 0.99, axis=2)) > 0.01
    before = pdf.read_bytes(), png.read_bytes()
    draw(scene, name, tmp_path)
    assert (pdf.read_bytes(), png.read_bytes()) == before
    assert {path.name for path in tmp_path.iterdir()} == set(KINDS[name].files)


@pytest.mark.parametrize("name", PICTURES)
def test_a_scene_without_a_reduced_run_is_drawn(of_runs, name, tmp_path):
    alone = ViewedScene("alone", "Alone", of_runs.mesh, 0.016, of_runs.positions, None)
    assert all(path.stat().st_size for path in draw(alone, name, tmp_path))


def test_the_table_has_a_row_for_each_run_with_its_error_and_gain(finished, of_pipeline, tmp_path):
    study, _ = finished
    (path,) = draw(of_pipeline, "runs", tmp_path)
    table = read_table(path, result=False)
    assert set(table.method[table.position_basis == "full"]) == set(study.methods)
    assert set(table.scene) == {SCENE}
    ran = table[table.frames > 0]
    assert len(ran)
    assert (ran.relative_error_within_horizon < 1.0).all()
    # an orthogonal projection amplifies nothing
    assert table.gain[table.method == "pod"].to_numpy() == pytest.approx(1.0)
    inside = table.position_basis == "pod"
    assert set(table.method[inside]) == {"full", "ecsw-1e-02"}
    assert table.gain[inside].isna().all()
    # the columns of the study's table, times and lengths among them
    assert set(reduced_reruns.column_names) <= set(table.columns)
    lengths = table[["ms_per_frame", "speedup", "error_over_extent", "shape_error"]]
    assert (lengths >= 0.0).all(axis=None)


def test_own_runs_agree_with_those_of_the_pipeline(of_pipeline, of_runs):
    """One run each, of the same scene, method and size, from two sources."""
    assert of_runs.positions == pytest.approx(of_pipeline.positions, abs=1e-6)
    assert [run.r for run in of_runs.runs] == [1, 2]
    (theirs,) = (run for run in of_pipeline.sizes("spring", "pod") if run.r == 2)
    (_, own) = of_runs.runs
    assert own.positions == pytest.approx(theirs.positions, abs=1e-5)
    assert own.error == pytest.approx(theirs.error, rel=1e-3)
    table = of_runs.tables["runs"]()
    assert table.relative_error_within_horizon.is_monotonic_decreasing
    assert table.gain.to_numpy() == pytest.approx(1.0)


def test_what_the_command_advises_from_has_the_columns_of_the_study(of_pipeline, of_runs, tmp_path):
    effects, costs = map(read_table, draw(of_pipeline, "advice", tmp_path))
    assert list(effects.columns) == list(effects_contribution.column_names)
    assert effects.effect.tolist() == ["spring", "gravity", "pins"]
    assert effects.above_floor.tolist()[1:] == [True, True]
    assert list(costs.columns) == list(accuracy_cost.column_names)
    assert {"fom", "full", "pod", "ecsw-1e-02"} <= set(costs.method)
    assert (costs.ms_per_frame > 0.0).all()
    with pytest.raises(ConfigurationError, match="advice: made of the pipeline's results alone"):
        draw(of_runs, "advice", tmp_path)


def test_a_scene_that_no_subspace_takes_has_none(tmp_path):
    study = small_study(tmp_path)
    scene = study.scene(SCENE)
    wind = {"effect": "wind", "velocity": [0.0, 0.0, 1.0]}
    plain = scene.model_dump(mode="json")
    windy = SceneConfig.model_validate({**plain, "effects": [*plain["effects"], wind]})
    only = study.only(SCENE)
    assert labels_of(only, SUBSPACES) == [{"scene": SCENE}]
    only.scenes = {SCENE: windy}
    assert labels_of(only, SUBSPACES) == []


def run_of(r: int, positions: np.ndarray, blowup_frame: int | None = None) -> ViewedRun:
    """A run with these positions (F' + 1, N, 3)."""
    read = partial(np.asarray, positions)
    return ViewedRun("spring", "pod", "POD", r, read, np.ones(len(positions)), blowup_frame, None)


def test_the_run_shown_is_the_largest_small_one():
    sizes = [run_of(r, np.zeros((1, 3, 3))) for r in (6, SHOWN, SHOWN + 1)]
    assert shown(sizes).r == SHOWN
    assert shown(sizes[2:]).r == SHOWN + 1


@given(ran=st.integers(0, 5), frame=st.integers(0, 9))
def test_a_run_that_ended_is_drawn_at_its_last_frame_and_says_so(ran, frame):
    positions = np.arange(ran + 1.0)[:, None, None] * np.ones((1, 3, 3))
    panel = panel_of(run_of(6, positions, ran), frame)
    assert np.all(panel.positions == min(frame, ran))
    assert panel.failure == (f"blew up at frame {ran}" if frame > ran else None)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with a scene."""
    small_study(tmp_path)
    return tmp_path


def test_a_command_runs_the_jobs_of_its_scene_and_draws(project, monkeypatch):
    monkeypatch.chdir(project)
    order = scene_order(["scene", SCENE, "frames", "--cores", "1"])
    assert order.arguments[:3] == ["--cores", "1", "--"]
    assert order.drawing == ["draw", SCENE, "--as", "frames", "--out", "results/scenes"]
    assert order.draws
    files = set(order.arguments[3:])
    assert {f"results/fom/{SCENE}/train.h5", f"results/sensitivity/{SCENE}.csv"} <= files
    assert not any("timings" in file for file in files)
    assert set(scene_order(["scene", SCENE]).arguments) > files
    assert not scene_order(["scene", SCENE, "-n"]).draws


def test_another_configuration_is_handed_on(project, monkeypatch):
    monkeypatch.chdir(project)
    order = scene_order(["scene", SCENE, "gif", "--config", "methods=[pod]"])
    assert order.drawing[-4:] == [
        "--out",
        "results/studies/own/scenes",
        "--config",
        "methods=[pod]",
    ]
    reruns = [file for file in order.arguments if "/reruns/" in file]
    assert reruns == [f"results/studies/own/reruns/{SCENE}/spring/pod.h5"]


def test_the_viewer_takes_the_scenes_of_the_configuration(project, monkeypatch):
    monkeypatch.chdir(project)
    order = scene_order(["viewer", "--config", f"viewer={{scenes: [{SCENE}]}}"])
    assert order.drawing[:2] == ["view", SCENE]
    assert f"results/studies/own/timings/{SCENE}.csv" in order.arguments
    assert scene_order(["viewer"]).drawing[1] == "small"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["scene"], "scene: the name of a scene is missing"),
        (["scene", "owm"], "scene: unknown scene 'owm'.*did you mean 'own'"),
        (["scene", SCENE, "frame"], "nothing is called 'frame'.*did you mean 'frames'"),
        (["viewer", SCENE], "viewer own: it takes no names"),
        (["viewer", "--config", "viewer={scenes: [owm]}"], "viewer.scenes: unknown scene 'owm'"),
        (["scene", SCENE, "--config", "methods=[pdo]"], "unknown method 'pdo'"),
    ],
)
def test_what_is_misspelt_is_named(project, monkeypatch, words, message):
    monkeypatch.chdir(project)
    with pytest.raises(ConfigurationError, match=message):
        scene_order(words)


def test_a_film_has_a_picture_for_each_frame_that_is_shown(scene, tmp_path):
    (path,) = draw(scene, "animation", tmp_path)
    frames = imageio_ffmpeg.read_frames(str(path))
    about = next(frames)
    shots = [np.frombuffer(shot, np.uint8) for shot in frames]
    assert about["codec"] == "h264"
    assert len(shots) == 5  # 8 frames of 0.016 s in steps of 2, and the start
    assert len({len(shot) for shot in shots}) == 1
    assert np.abs(shots[0].astype(int) - shots[-1]).max() > 50


def test_a_gif_moves_at_the_same_speed_for_ever(of_pipeline, tmp_path):
    with Image.open(*draw(of_pipeline, "gif", tmp_path)) as film:
        assert film.n_frames == 5
        assert film.info["loop"] == 0
        assert film.info["duration"] == pytest.approx(1000 * 2 * 0.016, abs=10)


@given(pictures=st.integers(1, 400), rate=st.floats(1.0, 30.0))
def test_pictures_of_a_gif_keep_the_rate_together(pictures, rate):
    each = durations(pictures, rate)
    assert sum(each) == pytest.approx(1000.0 * pictures / rate, abs=5.0)
    assert all(one % 10 == 0 and abs(one - 1000.0 / rate) <= 10.0 for one in each)


def test_paraview_gets_every_frame_with_its_time(scene, tmp_path):
    stray = tmp_path / "vtk" / "frame_00099.vtu"
    stray.parent.mkdir()
    stray.write_text("of a longer run")
    (path,) = draw(scene, "vtk", tmp_path)
    listed = ElementTree.parse(path).findall("Collection/DataSet")
    assert [float(d.get("timestep")) for d in listed] == pytest.approx(0.016 * np.arange(9))
    assert {d.get("file") for d in listed} == {p.name for p in path.parent.glob("*.vtu")}
    frame = meshio.read(path.with_name(listed[8].get("file")))
    assert np.array_equal(frame.points, scene.positions[8])
    assert ("velocity" in frame.point_data) == (scene.velocities is not None)
    if scene.velocities is not None:
        assert frame.point_data["velocity"] == pytest.approx(scene.velocities[8], rel=1e-6)
    methods = {run.method for run in scene.runs}
    assert {name.split()[1] for name in frame.point_data if " " in name} == methods


def test_the_viewer_shows_every_method_with_its_times(finished, tmp_path):
    study, results = finished
    timed = Path(TIMINGS.at(results, scene=SCENE))
    rows = pd.DataFrame(
        {
            "group": [None, "spring"],
            "method": [None, "pod"],
            "position_basis": None,
            "r": [None, 2],
            "implementation": ["compiled", "compiled"],
            "ms_per_frame": [2.0, 1.0],
        }
    )
    kept = pd.read_csv(timed)
    write_table(rows, timed)
    try:
        packed = of_page(*draw(scene_results(study, SCENE, results).viewed(), "viewer", tmp_path))
    finally:
        write_table(kept, timed)
    assert {run["method"] for run in packed["runs"]} == {m.title for m in study.methods.values()}
    assert packed["ms"] == 2.0
    assert {run["ms"] for run in packed["runs"] if run["r"] == 2} == {1.0, None}


def test_the_viewer_offers_the_sizes_of_the_configuration(finished, tmp_path):
    study, results = finished
    for ranks in ([2], ["full"]):
        changed = study.settings.viewer.model_copy(update={"ranks": tuple(ranks)})
        settings = study.settings.model_copy(update={"viewer": changed})
        other = Study(settings, study.root)
        scene = scene_results(other, SCENE, results).viewed()
        assert len({run.r for run in scene.runs}) == 2
        packed = of_page(*draw(scene, "viewer", tmp_path))
        assert len(packed["runs"]) == len(study.methods)
        assert ({run["r"] for run in packed["runs"]} == {2}) == (ranks == [2])


def of_page(page: Path) -> dict:
    """The scene that a page holds."""
    data = page.read_text("utf-8").split('<script id="scenes" type="application/json">')[1]
    (packed,) = json.loads(data.split("</script>")[0])
    return packed
