"""Elements in blocks of lanes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import pdrom


def test_an_edit_of_an_inlined_function_reaches_every_kernel(tmp_path):
    """The file of the spring does not change, but its cached kernel must."""
    shutil.copytree(
        Path(pdrom.__file__).parent,
        tmp_path / "src" / "pdrom",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    lanes = tmp_path / "src" / "pdrom" / "model" / "constraints" / "lanes.py"
    before = _spring_in(tmp_path)
    text = lanes.read_text()
    loaded = "        at(work, first * LANES + lane),"
    assert loaded in text
    lanes.write_text(text.replace(loaded, "        2.0 * at(work, first * LANES + lane),"))
    assert before == pytest.approx([1.0, 0.0, 0.0])
    assert _spring_in(tmp_path) == pytest.approx([2.0, 0.0, 0.0])


_PROGRAM = """
import numpy as np
from pdrom.model.constraints.spring import EdgeSpring
from pdrom.model.mesh.types import Mesh
points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
mesh = Mesh(points, np.array([[0, 1, 2]]))
group = EdgeSpring(EdgeSpring.Config(weight=1.0), mesh, np.ones(3))
print(*(float(x) for x in group.project(np.array([[0.0, 0, 0], [3, 0, 0], [0, 1, 0]]))[0]))
"""


def _spring_in(folder: Path) -> list[float]:
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM],
        env={**os.environ, "PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(folder / "c")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [float(x) for x in done.stdout.split()]
