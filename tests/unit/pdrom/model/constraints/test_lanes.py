"""Elements in blocks of lanes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pdrom
from pdrom.model.constraints.lanes import (
    LANES,
    blocks,
    kernel,
    pack,
    perpendicular,
    take,
    workspace,
)


@kernel
def _take(packed, numbers, elements, start, out):
    take(packed, numbers, elements, start, out)


@kernel
def _perpendicular(x, y, z):
    return perpendicular((x, y, z))


@pytest.mark.parametrize("elements", [1, LANES - 1, LANES, LANES + 1, 3 * LANES])
def test_packed_numbers_are_where_they_should_be(elements, rng):
    numbers = rng.standard_normal((elements, 4))
    packed = pack(numbers)
    assert packed.shape == (blocks(elements) * 4 * LANES,)
    for e in range(elements):
        for i in range(4):
            assert packed[(e // LANES * 4 + i) * LANES + e % LANES] == numbers[e, i]
    filled = packed.reshape(-1, 4, LANES)[-1].T[(elements - 1) % LANES :]
    assert (filled == numbers[-1]).all()


def test_taken_elements_are_the_picked_ones(rng):
    numbers = rng.standard_normal((2 * LANES + 5, 3))
    picked, out = rng.permutation(len(numbers)), workspace(3)
    for start in range(0, len(picked), LANES):
        _take(pack(numbers), 3, picked, start, out)
        wanted = picked[np.minimum(start + np.arange(LANES), len(picked) - 1)]
        assert np.array_equal(out.reshape(3, LANES).T, numbers[wanted])


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (-1, 2, 0.5)])
def test_perpendicular_is_a_unit_vector_at_right_angles(axis):
    unit = np.array(axis) / np.linalg.norm(axis)
    other = np.array(_perpendicular(*unit))
    assert abs(other @ unit) < 1e-15
    assert np.linalg.norm(other) == pytest.approx(1.0, rel=1e-15)


def test_an_edit_of_an_inlined_function_reaches_every_kernel(tmp_path):
    """The spring's own file stays as it is, its cached kernel must not."""
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
