"""Mesh files that are read or refused, and the ways in which the reading process may end."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from mesh_files import write_mesh, zeros_vtu
from pdrom.core.errors import ConfigurationError, MeshError
from pdrom.model.mesh import files, reader
from pdrom.model.mesh.files import MeshLimits, mesh_limits, read_mesh_file

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3\nf 1 3 4\n"


@pytest.fixture
def square(tmp_path: Path) -> Path:
    path = tmp_path / "square.obj"
    path.write_text(SQUARE)
    return path


def limited(monkeypatch: pytest.MonkeyPatch, **limits: int) -> None:
    """Other limits than the usual ones."""
    monkeypatch.setattr(files, "mesh_limits", lambda: MeshLimits(**limits))


def replaced(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Another script in place of the reader."""
    monkeypatch.setattr(files, "get_data", lambda *_: script.encode())


@pytest.mark.parametrize("suffix", [".obj", ".vtu"])
def test_a_mesh_file_is_read_in_any_folder(tmp_path, suffix):
    """By the reading process, also if the path has a blank and letters beyond ASCII.

    This test starts a process; `test_guards` reads all formats without one.
    """
    folder = tmp_path / "Étude du maillage"
    folder.mkdir()
    mesh = write_mesh(folder / f"größe{suffix}")
    loaded = read_mesh_file(folder / f"größe{suffix}")
    assert np.array_equal(loaded.points, mesh.points)
    assert np.array_equal(loaded.triangles, mesh.triangles)


def test_readers_of_meshes_open_no_second_file(tmp_path, monkeypatch):
    """They open neither files next to the mesh nor files that the mesh names."""
    contents = {}
    for suffix in reader.READERS:
        write_mesh(tmp_path / f"mesh{suffix}")
        contents[suffix] = (tmp_path / f"mesh{suffix}").read_bytes()
    contents[".obj"] = b"mtllib mesh.mtl\n" + contents[".obj"]
    outside = f'<!DOCTYPE VTKFile SYSTEM "file://{tmp_path}/mesh.obj"><VTKFile '.encode()
    contents[".vtu"] = contents[".vtu"].replace(b"<VTKFile ", outside, 1)
    for module in ("builtins", "io", "os"):
        monkeypatch.setattr(f"{module}.open", None)
    assert all(len(read(contents[suffix]).points) for suffix, read in reader.READERS.items())


def test_a_mesh_file_that_takes_too_long_is_refused(square, monkeypatch):
    limited(monkeypatch, seconds=1)
    replaced(monkeypatch, "import resource\nresource.setrlimit(0, (1, 1))\nwhile True:\n    pass")
    with pytest.raises(MeshError, match=r"square\.obj: .*(1 s of processor time|signal 9)"):
        read_mesh_file(square)


def test_a_small_mesh_file_that_unpacks_to_gigabytes_is_refused(tmp_path, monkeypatch):
    limited(monkeypatch, memory=600_000_000)
    path = tmp_path / "zeros.vtu"
    path.write_text(zeros_vtu(160))
    assert path.stat().st_size < 1_000_000
    with pytest.raises(MeshError, match=r"in 0.6 GB of memory; PDROM_MESH_LIMITS=2"):
        read_mesh_file(path)


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ({"vertices": 3}, "holds 4 vertices, allowed: at most 3"),
        ({"cells": 1}, "holds 2 cells, allowed: at most 1"),
        ({"file_bytes": 10}, "larger than 10 bytes"),
    ],
)
def test_a_mesh_above_the_limits_is_refused(square, monkeypatch, limit, message):
    limited(monkeypatch, **limit)
    with pytest.raises(MeshError, match=message):
        read_mesh_file(square)


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("import os\nos.kill(os.getpid(), 9)", r"ended by signal 9 \(Killed\)"),
        ("raise RuntimeError('boom')", "failed with status 1: RuntimeError: boom"),
        ("raise SystemExit(7)", "failed with status 7: no error message"),
    ],
)
def test_a_mesh_whose_reader_crashes_is_named(square, monkeypatch, script, message):
    replaced(monkeypatch, script)
    with pytest.raises(MeshError, match=f"square.obj: the reader .*{message}"):
        read_mesh_file(square)


def test_a_reader_that_waits_is_stopped(square, monkeypatch):
    limited(monkeypatch, deadline=0)
    replaced(monkeypatch, "import signal\nsignal.pause()")
    with pytest.raises(MeshError, match=r"square\.obj: not read after 0 s"):
        read_mesh_file(square)


def test_an_unchanged_mesh_file_is_read_once(square, monkeypatch):
    started = []
    run = subprocess.run
    monkeypatch.setattr(
        files.subprocess, "run", lambda *args, **more: started.append(1) or run(*args, **more)
    )
    first, again = read_mesh_file(square), read_mesh_file(square)
    assert len(started) == 1
    first.points[0] = 7.0  # the next caller does not see changes that a caller makes to its mesh
    assert again.points[0].tolist() == read_mesh_file(square).points[0].tolist() == [0.0, 0.0, 0.0]
    square.write_text(SQUARE.replace("v 0 0 1", "v 0 0 2"))
    assert read_mesh_file(square).points[3].tolist() == [0.0, 0.0, 2.0]
    assert len(started) == 2


def test_environment_variables_raise_all_limits(monkeypatch):
    monkeypatch.delenv("PDROM_MESH_LIMITS", raising=False)
    plain = mesh_limits()
    monkeypatch.setenv("PDROM_MESH_LIMITS", "2.5")
    raised = mesh_limits()
    assert (raised.seconds, raised.vertices) == (25, 2_500_000)
    assert (raised.memory, raised.cells) == (2.5 * plain.memory, 2.5 * plain.cells)


@pytest.mark.parametrize("value", ["", "many", "nan", "inf", "0.5", "-1", "1001"])
def test_faulty_limits_are_named(monkeypatch, value):
    monkeypatch.setenv("PDROM_MESH_LIMITS", value)
    with pytest.raises(ConfigurationError, match=r"PDROM_MESH_LIMITS = .* from 1 to 1000"):
        mesh_limits()
