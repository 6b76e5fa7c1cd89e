"""``pdrom view``: a page, a picture and files for ParaView, for every kind of run."""

import json
import shutil
from pathlib import Path
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
import pytest
from PIL import Image

from builders import SMALL
from pdrom.api import load
from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.core.errors import StorageError
from pdrom.core.store.checksum import write_block


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a full-order run and a reduced one."""
    folder = tmp_path_factory.mktemp("runs")
    scene, full = str(folder / "small.yaml"), str(folder / "small.h5")
    Path(scene).write_text(SMALL, encoding="utf-8")
    assert run(["run", scene]) == Status.DONE
    assert run(["train", scene, full, "--method", "gappy", "--r", "2"]) == Status.DONE
    assert run(["run", scene, "--model", str(folder / "small.model.h5")]) == Status.DONE
    return folder


def files(runs: Path) -> list[str]:
    return [str(runs / f"{name}.h5") for name in ("small", "small_small")]


def test_a_run_of_an_earlier_version_which_stored_a_requested_error_is_read(runs, tmp_path):
    path = tmp_path / "run.h5"
    shutil.copy(runs / "small.h5", path)
    with h5py.File(path, "r+") as file:
        settings = json.loads(file.attrs["configuration"])
        settings["scene"]["requested_error"] = None
        file.attrs["configuration"] = json.dumps(settings)
    write_block(path)
    assert load(path).scene.config == load(runs / "small.h5").scene.config


def test_the_page_the_picture_and_the_files_for_paraview_have_all_runs(runs, tmp_path, capsys):
    out = ["--out", str(tmp_path / "p.html"), "--png", str(tmp_path / "p.png")]
    assert run(["view", *files(runs), *out, "--vtk", str(tmp_path / "vtk")]) == Status.DONE
    assert len(capsys.readouterr().out.splitlines()) == 3
    assert '"title":"a model of \'small\' (spring' in (tmp_path / "p.html").read_text("utf-8")
    with Image.open(tmp_path / "p.png", formats=["PNG"]) as picture:
        assert min(picture.size) > 100
    listed = ElementTree.parse(tmp_path / "vtk" / "run.pvd").findall("Collection/DataSet")
    full = load(files(runs)[0])
    assert len(listed) == len(full.positions)
    last = meshio.read(tmp_path / "vtk" / listed[-1].get("file"))
    assert np.array_equal(last.points, full.positions[-1])
    assert {name.split(" ")[0] for name in last.point_data} == {"displacement", "a"}
    assert [path.name for path in tmp_path.rglob(".*")] == []


def test_files_for_paraview_replace_and_remove_only_files_for_paraview(runs, tmp_path, capsys):
    frames = tmp_path / "vtk"
    view = ["view", files(runs)[0], "--out", str(tmp_path / "p.html"), "--vtk", str(frames)]
    assert run(view) == run(view) == Status.DONE
    for name in ("frame_00001.vtu", "frame_99999.vtu", "run.pvd"):
        (frames / name).write_text("mine")
        capsys.readouterr()
        assert run(view) == Status.FAULTY
        assert f"{name}: cannot be written (a file that pdrom has" in capsys.readouterr().err
        assert (frames / name).read_text() == "mine"
        (frames / name).unlink()
    (frames / "frame_00003.vtu").unlink()
    (frames / "frame_00003.vtu").mkdir()
    for folder in (frames, tmp_path / "p.html"):
        assert run([*view[:3], str(tmp_path / "q.html"), "--vtk", str(folder)]) == Status.FAULTY
        assert "cannot be written" in capsys.readouterr().err
        assert not (tmp_path / "q.html").exists()  # refused before anything is written


def first_of(name, value):
    """A change of a file: another first number of its dataset ``name``."""
    return lambda file: file[name].__setitem__((0,) * file[name].ndim, value)


def shortened(*names):
    """A change of a file: the last entry of its datasets ``names`` is missing."""
    return lambda file: [file.__setitem__(name, file.pop(name)[:-1]) for name in names]


AT = "snapshots/spring/frames"


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("small", shortened("positions"), r"positions of float64 \(12, 30, 3\)"),
        ("small", first_of("positions", np.nan), r"positions: entry \(0, 0, 0\) is nan"),
        ("small", shortened("timings"), "11 of 12 frames"),
        ("small", first_of("snapshots/spring/p", np.nan), "snapshots of spring: entry"),
        ("small", lambda file: file.attrs.modify("configuration", "{"), "contains no valid run"),
        ("small", lambda file: file["mesh"].pop("points"), "points"),
        ("small_small", first_of("mesh/triangles", 999), "triangle 0 has the corners"),
        ("small", first_of("positions", 5.0), "frame 0 differ"),
        ("small", first_of("timings", -1e9), "a time is negative"),
        ("small", shortened("frame_error"), "frame_error of"),
        *(("small", first_of(AT, n), "spring: frames") for n in (-1, 99)),
        ("small_small", lambda f: f.attrs.modify("blowup_frame", 3), "blow-up in frame 3"),
    ],
)
def test_wrong_content_with_a_valid_checksum_is_refused(runs, tmp_path, name, change, words):
    path = tmp_path / "run.h5"
    shutil.copy(runs / f"{name}.h5", path)
    with h5py.File(path, "r+") as file:
        change(file)
    write_block(path)
    with pytest.raises(StorageError, match=rf"run\.h5: .*{words}"):
        load(path)
