"""Damaged mesh files of every format are read or refused with a named error on one line.

The reader's limits of memory and time apply (`pdrom.model.mesh.files`); the time limit is a fifth
of the usual 10 s.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from mesh_files import VOLUMES, write_mesh
from pdrom.core.errors import PdromError
from pdrom.model.mesh import files, reader
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.files import MeshLimits

CUTS, FLIPS, HOLES = 40, 8, 4


def damaged(content: bytes, seed: int) -> Iterator[bytes]:
    """The content cut at `CUTS` places, with flipped bytes, and with blocks of zeros."""
    for cut in np.linspace(0, len(content), CUTS, endpoint=False, dtype=int):
        yield content[:cut]
    rng = np.random.default_rng(seed)
    for _ in range(FLIPS):
        changed = np.frombuffer(content, np.uint8).copy()
        places = rng.integers(0, len(content), rng.integers(1, 6))
        changed[places] ^= rng.integers(1, 256, len(places), dtype=np.uint8)
        yield changed.tobytes()
    for start in rng.integers(0, len(content), HOLES):
        length = min(len(content) - start, 64)
        yield content[:start] + bytes(int(length)) + content[start + length :]


def read(path: Path) -> str:
    """Message of the refusal, empty if the mesh is accepted."""
    try:
        MeshFile(kind="file", path=path.name).build(path.parent)
    except PdromError as error:
        return str(error)
    return ""


@pytest.mark.slow
@pytest.mark.parametrize("suffix", reader.READERS)
def test_damaged_files_are_read_or_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    write_mesh(tmp_path / f"intact{suffix}", "tetra" if suffix in VOLUMES else "triangle")
    assert read(tmp_path / f"intact{suffix}") == ""
    monkeypatch.setattr(files, "mesh_limits", lambda: MeshLimits(seconds=2))
    paths = []
    for number, content in enumerate(damaged((tmp_path / f"intact{suffix}").read_bytes(), 1)):
        paths.append(tmp_path / f"{number}{suffix}")
        paths[-1].write_bytes(content)
    messages = [read(path) for path in paths]
    assert len(messages) == CUTS + FLIPS + HOLES
    assert "no cells" in messages[0] or "not a readable mesh" in messages[0]
    for message in messages:
        assert "\n" not in message
        assert "the reader failed" not in message
        assert len(message) < 700
