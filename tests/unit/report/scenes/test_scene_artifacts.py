"""What is made of one scene: files that show its runs, from its own results alone."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import h5py
import imageio_ffmpeg
import meshio
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from PIL import Image

from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import FULL_ORDER, SUBSPACES, TIMINGS, VTK
from pdrom.core.store import check_file, read_table, write_table
from pdrom.model.scene import SceneConfig
from pdrom.pipeline.contents import labels_of
from pdrom.pipeline.scene_command import scene_arguments
from pdrom.pipeline.study import Study
from pdrom.report.figures.kit.read import RerunInfo
from pdrom.report.scenes.catalogue import ARTIFACTS, default_files
from pdrom.report.scenes.gif import durations
from pdrom.report.scenes.job import make
from pdrom.report.scenes.sizes import SHOWN, shown
from pdrom.report.scenes.viewer import make_index
from pdrom.tables.accuracy_cost import accuracy_cost
from pdrom.tables.effects_contribution import effects_contribution
from pdrom.tables.reduced_reruns import reduced_reruns
from small_scene import SCENE, order, run_jobs, small_study


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, str]:
    """A study and its results folder, with everything that the scene's artifacts read."""
    root = tmp_path_factory.mktemp("own")
    study, results = small_study(root), str(root / "results")
    run_jobs(study, results)
    return study, results


def made(finished: tuple[Study, str], name: str) -> dict[str, str]:
    """Files of an artifact, made."""
    study, results = finished
    files = {k: p.at(results, scene=SCENE) for k, p in ARTIFACTS[name].outputs.items()}
    make(order(study, results, name), files)
    return files


@pytest.mark.parametrize("name", ["frames", "error_against_r", "error_against_time"])
def test_pictures_are_drawn(finished, name):
    files = made(finished, name)
    picture = imread(files["png"])[..., :3]
    assert np.mean(np.any(picture < 0.99, axis=2)) > 0.01
    assert {check_file(path) for path in files.values()} == {"intact"}


def test_a_picture_is_the_same_the_second_time(finished):
    before = [Path(path).read_bytes() for path in made(finished, "error_against_time").values()]
    after = [Path(path).read_bytes() for path in made(finished, "error_against_time").values()]
    assert after == before


def test_the_table_has_a_row_for_each_run_with_its_error_and_gain(finished):
    study, _ = finished
    table = read_table(made(finished, "runs")["table"])
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


def test_what_the_command_advises_from_has_the_columns_of_the_study(finished):
    files = made(finished, "advice")
    effects, costs = read_table(files["effects"]), read_table(files["costs"])
    assert list(effects.columns) == list(effects_contribution.column_names)
    assert effects.effect.tolist() == ["spring", "gravity", "pins"]
    assert effects.above_floor.tolist()[1:] == [True, True]
    assert list(costs.columns) == list(accuracy_cost.column_names)
    assert {"fom", "full", "pod", "ecsw-1e-02"} <= set(costs.method)
    assert (costs.ms_per_frame > 0.0).all()


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


def test_the_study_does_not_hold_the_scene(finished):
    study, results = finished
    assert SCENE not in study.scenes
    assert not (Path(results) / "tables").exists()
    assert not (Path(results) / "figures").exists()


def test_the_run_shown_is_the_largest_small_one_that_ran():
    info = RerunInfo("r0006", 6, False, False, -1, 1.0, 9)
    sizes = [replace(info, r=r, label=f"r{r:04d}") for r in (6, SHOWN, SHOWN + 1)]
    assert shown(sizes).r == SHOWN
    assert shown(sizes[2:]).r == SHOWN + 1
    assert shown([replace(info, marked=True)]) is None


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with a scene."""
    small_study(tmp_path)
    return tmp_path


def test_the_command_names_the_files(project):
    files = default_files("results", SCENE)
    assert scene_arguments([SCENE, "-n", "--cores", "1"], project) == [
        "-n", "--cores", "1", "--", *files,
    ]  # fmt: skip
    assert scene_arguments([SCENE, "runs"], project) == ["--", f"results/scenes/{SCENE}/runs.csv"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "scene: the name of a scene is missing"),
        (["owm"], "scene: unknown scene 'owm'.*did you mean 'own'"),
        ([SCENE, "frame"], "nothing is called 'frame'.*did you mean 'frames'"),
    ],
)
def test_what_is_misspelt_is_named(project, words, message):
    with pytest.raises(ConfigurationError, match=message):
        scene_arguments(words, project)


def test_a_film_has_a_picture_for_each_frame_that_is_shown(finished):
    path = Path(made(finished, "animation")["film"])
    assert check_file(path) == "intact"
    frames = imageio_ffmpeg.read_frames(str(path))
    about = next(frames)
    shots = [np.frombuffer(shot, np.uint8) for shot in frames]
    assert about["codec"] == "h264"
    assert len(shots) == 5  # 8 frames of 0.016 s in steps of 2, and the start
    assert len({len(shot) for shot in shots}) == 1
    assert np.abs(shots[0].astype(int) - shots[-1]).max() > 50


def test_a_gif_moves_at_the_same_speed_for_ever(finished):
    with Image.open(made(finished, "gif")["film"]) as film:
        assert film.n_frames == 5
        assert film.info["loop"] == 0
        assert film.info["duration"] == pytest.approx(1000 * 2 * 0.016, abs=10)


@given(pictures=st.integers(1, 400), rate=st.floats(1.0, 30.0))
def test_pictures_of_a_gif_keep_the_rate_together(pictures, rate):
    each = durations(pictures, rate)
    assert sum(each) == pytest.approx(1000.0 * pictures / rate, abs=5.0)
    assert all(one % 10 == 0 and abs(one - 1000.0 / rate) <= 10.0 for one in each)


def test_paraview_gets_every_frame_with_its_time(finished):
    study, results = finished
    stray = Path(VTK.at(results, scene=SCENE)).with_name("frame_00099.vtu")
    stray.parent.mkdir(parents=True, exist_ok=True)
    stray.write_text("of a longer run")
    path = Path(made(finished, "vtk")["collection"])
    listed = ElementTree.parse(path).findall("Collection/DataSet")
    assert [float(d.get("timestep")) for d in listed] == pytest.approx(0.016 * np.arange(9))
    assert {d.get("file") for d in listed} == {p.name for p in path.parent.glob("*.vtu")}
    with h5py.File(FULL_ORDER.at(results, scene=SCENE, run="train")) as run:
        last, velocity = run["positions"][8], run["velocities"][8]
    frame = meshio.read(path.with_name(listed[8].get("file")))
    assert np.array_equal(frame.points, last)
    assert frame.point_data["velocity"] == pytest.approx(velocity, rel=1e-6)
    assert {name.split()[1] for name in frame.point_data if " " in name} == set(study.methods)


def test_the_viewer_shows_every_method_with_its_times(finished):
    study, results = finished
    page = Path(made(finished, "viewer")["page"])
    (packed,) = _scenes(page)
    assert {run["method"] for run in packed["runs"]} == {m.title for m in study.methods.values()}
    assert {run["ms"] for run in packed["runs"]} == {None}
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
    write_table(rows, TIMINGS.at(results, scene=SCENE))
    make_index([order(study, results, "viewer").results] * 2, str(page))
    first, second = _scenes(page)
    assert first == second
    assert first["ms"] == 2.0
    assert {run["ms"] for run in first["runs"] if run["r"] == 2} >= {1.0}


def _scenes(page: Path) -> list[dict]:
    data = page.read_text("utf-8").split('<script id="scenes" type="application/json">')[1]
    return json.loads(data.split("</script>")[0])
