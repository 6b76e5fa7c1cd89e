"""``pdrom cost``: the table that it prints, its picture, and what it refuses before it runs."""

import os
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest

from builders import SMALL
from pdrom import api
from pdrom.command.base import Status
from pdrom.command.cost import shown
from pdrom.command.main import run
from pdrom.model.mesh.generators import cloth


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a scene, and a coarser mesh in a folder beside the scene."""
    monkeypatch.chdir(tmp_path)
    Path("scenes").mkdir()
    Path("scenes/small.yaml").write_text(SMALL, encoding="utf-8")
    mesh = cloth(5, 4, "xz")
    meshio.write("coarse.obj", meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]))
    return tmp_path


def test_settings_are_printed_and_drawn_with_meshes_and_models_of_files(folder, capsys):
    full = api.run(api.load_scene("scenes/small.yaml"))
    api.train(full, modes=6, converged=False).save("own.h5")
    asked = ["cost", "scenes/small.yaml", "--coarser", "coarse.obj", "--model", "own.h5"]
    assert run([*asked, "--plot", "cost.png"]) == Status.DONE
    said = capsys.readouterr().out
    for words in ("2 iterations on 20 vertices", "model own.h5, converged", "\n* ", "12 frames"):
        assert words in said
    assert Path("cost.png").read_bytes().startswith(b"\x89PNG")


def test_the_table_marks_the_best_and_says_what_is_missing():
    table = pd.DataFrame({
        "setting": ["2 iterations", "model own.h5, converged"], "best": [True, False],
        "position_error": [0.0123, np.inf], "deformation_error": [np.nan, np.inf], "ms": [1.5, 20],
    })  # fmt: skip
    table.attrs = {"frames": 60, "busy": True, "mesh_error": 0.034}
    lines = shown(table, 90).splitlines()
    assert lines[1].split() == ["*", "2", "iterations", "0.012", "-", "1.5"]
    assert lines[2].split() == ["model", "own.h5,", "converged", *["blew", "up"] * 2, "20"]
    assert "over 90 frames; times of the first 60 frames, unreliable" in lines[4]
    assert "error of the mesh itself: 0.034" in lines[5]


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ("--coarser none.obj", "none.obj: no such mesh file"),
        ("--model none.h5", "none.h5: no such file"),
        ("--plot cost", "--plot cost: the name of a picture ends in .png"),
        ("--plot taken.png", "taken.png: cannot be written"),
        ("--coarser taken.png --plot taken.png", "taken.png: would be overwritten"),
    ],
)
def test_wrong_files_are_refused_before_anything_runs(folder, capsys, options, fault):
    Path("taken.png").write_bytes(b"somebody's own\n")
    assert run(["cost", "scenes/small.yaml", *options.split()]) == Status.FAULTY
    said = capsys.readouterr()
    assert said.err.startswith(f"pdrom: {fault}")
    assert len(said.err.splitlines()) == 1
    assert os.listdir(folder / "scenes") == ["small.yaml"]
