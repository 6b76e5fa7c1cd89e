"""The mesh files of the replication are what their script writes."""

import runpy
import sys

from places import ROOT

FOLDER = ROOT / "config" / "scenes" / "meshes"


def test_the_script_writes_the_mesh_files_again(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(sys, "argv", ["mapped_grids.py", str(tmp_path)])
    runpy.run_path(str(FOLDER / "mapped_grids.py"), run_name="__main__")
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"tube.obj", "dome.obj", "arch.vtu", "taper.vtu"}
    for name in names:
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes()
