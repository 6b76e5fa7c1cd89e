"""pdrom draw and view: own runs and scenes of the pipeline, and what cannot be drawn."""

from pathlib import Path

import pytest

from builders import SMALL
from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.command.results import files_of
from pdrom.report.scenes.kinds import DEFAULT, KINDS


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two reduced runs of a scene."""
    folder = tmp_path_factory.mktemp("runs")
    scene = folder / "small.yaml"
    scene.write_text(SMALL, encoding="utf-8")
    run(["run", str(scene)])
    for r in ("1", "2"):
        asked = ["--group", "spring", "--r", r, "--run", str(folder / "small.h5")]
        assert run(["reduce", str(scene), *asked]) == Status.DONE
    return folder


def reduced(runs: Path) -> list[str]:
    return [str(runs / f"small_spring_gappy_{r}.h5") for r in (1, 2)]


def test_runs_are_drawn_into_a_folder_of_their_scene(runs, tmp_path, capsys):
    before = {path: path.read_bytes() for path in runs.iterdir()}
    assert run(["draw", *reduced(runs), "--out", str(tmp_path)]) == Status.DONE
    wanted = {file for kind in DEFAULT for file in KINDS[kind].files}
    assert {path.name for path in (tmp_path / "small").iterdir()} == wanted
    said = capsys.readouterr().out
    assert [line.split(":")[0] for line in said.splitlines()] == list(DEFAULT)
    assert {path: path.read_bytes() for path in runs.iterdir()} == before


def test_without_a_folder_they_lie_beside_the_first_file(runs, capsys):
    assert run(["draw", *reduced(runs), "--as", "runs"]) == Status.DONE
    table = (runs / "small" / "runs.csv").read_text("utf-8").splitlines()
    assert len(table) == 3
    assert str(runs / "small" / "runs.csv") in capsys.readouterr().out


def test_a_full_order_run_alone_is_drawn(runs, tmp_path):
    asked = ["draw", str(runs / "small.h5"), "--as", "frames", "vtk", "--out", str(tmp_path)]
    assert run(asked) == Status.DONE
    assert len(list(tmp_path.rglob("*.vtu"))) == 13


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["RUN", "--as", "frame"], "--as: nothing is called 'frame'"),
        (["RUN", "--as", "frame"], "did you mean 'frames'"),
        (["RUN", "--as", "advice"], "advice: made of the pipeline's results alone"),
        (["none.h5"], "none.h5: no such file"),
        (["spring_opo"], "unknown scene 'spring_opo'"),
        (
            ["sheet200_strain", "--config", "study=nobody_ran_it"],
            "holds no run of it; ./reproduce scene",
        ),
        (["spring_oop", "--configfile", "none.yaml"], "none.yaml: no such configuration file"),
        (["spring_oop", "--config", "ranks=[0]"], "ranks"),
        (["RUN", "--out", "RUN"], "not a folder"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(runs, arguments, words, capsys):
    asked = [reduced(runs)[0] if word == "RUN" else word for word in arguments]
    assert run(["draw", *asked]) == Status.FAULTY
    told = capsys.readouterr().err.splitlines()[-1]
    assert told.startswith("pdrom: ")
    assert words in told


def test_two_scenes_of_one_name_are_not_mixed(runs, tmp_path, capsys):
    other = tmp_path / "small.yaml"
    other.write_text(SMALL.replace("frames: 12", "frames: 5"), encoding="utf-8")
    run(["run", str(other)])
    for command in ("draw", "view"):
        assert run([command, reduced(runs)[0], str(tmp_path / "small.h5")]) == Status.FAULTY
        assert "two different scenes are called 'small'" in capsys.readouterr().err


def test_a_plain_word_is_a_scene_unless_a_file_has_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = ["spring_oop", "a.h5", "in/b", "."]
    assert files_of(names) == ["a.h5", "in/b", "."]
    Path("spring_oop").touch()
    assert files_of(names) == names
