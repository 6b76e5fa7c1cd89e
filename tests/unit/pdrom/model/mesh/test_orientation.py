"""Triangles that are listed either way round are turned like their neighbours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdrom.core.errors import MeshError
from pdrom.model.mesh.checks import turned_alike
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.generators import bar, cloth

SHEET = cloth(4, 5).triangles
CLOSED = bar(3, 3, 4).triangles
BOTH = np.concatenate([SHEET, CLOSED + SHEET.max() + 1])


@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 0.4))
@pytest.mark.parametrize("triangles", [SHEET, CLOSED, BOTH], ids=["sheet", "closed", "two parts"])
def test_the_fewer_ones_are_turned(triangles, seed, share):
    rng = np.random.default_rng(seed)
    count = int(share * min(len(SHEET), len(CLOSED)))
    flipped = np.zeros(len(triangles), dtype=bool)
    flipped[rng.permutation(len(triangles))[:count]] = True
    given_so = np.where(flipped[:, None], triangles[:, ::-1], triangles)
    order = rng.permutation(len(triangles))
    assert np.array_equal(turned_alike(given_so[order], "mesh"), flipped[order])


def test_a_strip_with_one_side_is_refused():
    """Möbius' strip of six triangles: the ends of a strip are joined with half a turn."""
    strip = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4], [4, 5, 1], [5, 0, 1]])
    with pytest.raises(MeshError, match=r"strip: the surface about triangle 0 .* one side only"):
        turned_alike(strip, "strip")
    assert not turned_alike(strip[:-1], "open strip")[0]


def test_a_mesh_file_with_a_triangle_the_other_way_round(tmp_path, caplog):
    mesh = cloth(3, 3)
    cells = mesh.triangles.copy()
    cells[2] = cells[2, ::-1]
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.points]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in cells]
    (tmp_path / "sheet.obj").write_text("\n".join(lines))
    read = MeshFile(kind="file", path="sheet.obj").build(tmp_path)
    assert "1 of 8 triangles are listed the other way round" in caplog.text
    sides = np.cross(*(read.points[read.triangles[:, k]] - read.points[read.triangles[:, 0]]
                       for k in (1, 2)))  # fmt: skip
    assert (sides[:, 2] > 0.0).all()
