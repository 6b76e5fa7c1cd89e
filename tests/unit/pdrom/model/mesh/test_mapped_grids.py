"""The script of the replication's mesh files writes exactly these files."""

import runpy
import sys

from places import ROOT


def test_the_script_writes_the_mesh_files_again(tmp_path, monkeypatch) -> None:
    folder = ROOT / "config" / "scenes" / "meshes"
    monkeypatch.setattr(sys, "argv", ["mapped_grids.py", str(tmp_path)])
    runpy.run_path(str(folder / "mapped_grids.py"), run_name="__main__")
    for name in ("tube.obj", "dome.obj", "arch.vtu", "taper.vtu"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
