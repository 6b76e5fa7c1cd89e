"""``pdrom cost``: the printed table, its picture, and arguments that are refused before a run."""

import os
from pathlib import Path

import meshio
import pytest

from builders import SMALL
from pdrom import api
from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.model.mesh.generators import cloth


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a scene, and a folder next to it with a coarser mesh."""
    monkeypatch.chdir(tmp_path)
    Path("scenes").mkdir()
    Path("scenes/small.yaml").write_text(SMALL, encoding="utf-8")
    mesh = cloth(5, 4, "xz")
    meshio.write("coarse.obj", meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]))
    return tmp_path


def test_the_cost_table_of_mesh_and_model_files_is_printed_and_drawn(folder, capsys):
    full = api.run(api.load_scene("scenes/small.yaml"))
    api.train(full, modes=6, converged=False).save("own.h5")
    asked = ["cost", "scenes/small.yaml", "--coarser", "coarse.obj", "--model", "own.h5"]
    assert run([*asked, "--plot", "cost.png"]) == Status.DONE
    said = capsys.readouterr().out
    for words in ("2 iterations on 20 vertices", "model own.h5, converged", "\n* ", "12 frames"):
        assert words in said
    assert Path("cost.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ("--coarser none.obj", "none.obj: no such mesh file"),
        ("--model none.h5", "none.h5: no such file"),
        ("--plot cost", "--plot cost: only PNG is written; end the name in .png"),
        ("--plot taken.png", "taken.png: cannot be written"),
        ("--coarser taken.png --plot taken.png", "taken.png: the output would replace a file"),
    ],
)
def test_wrong_files_are_refused_before_anything_runs(folder, capsys, options, fault):
    Path("taken.png").write_bytes(b"somebody's own\n")
    assert run(["cost", "scenes/small.yaml", *options.split()]) == Status.FAULTY
    said = capsys.readouterr()
    assert said.err.startswith(f"pdrom: {fault}")
    assert len(said.err.splitlines()) == 1
    assert os.listdir(folder / "scenes") == ["small.yaml"]
