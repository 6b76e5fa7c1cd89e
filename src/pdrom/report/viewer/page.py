"""Writing the page: scripts and runs in one file."""

import os
from collections.abc import Sequence
from importlib.resources import files

from pdrom.core.errors import StorageError
from pdrom.core.store import write_text
from pdrom.report.live.page import filled, safe_json
from pdrom.report.viewer.pack import pack_scene
from pdrom.report.viewer.runs import ViewedScene

LARGEST = 25_000_000  # bytes


def write_page(scenes: Sequence[ViewedScene], path: str | os.PathLike[str]) -> None:
    """Write the viewer of some ``scenes`` to ``path``.

    Raises
    ------
    StorageError
        The page would be larger than a browser opens with ease.
    """
    text = page([pack_scene(scene) for scene in scenes])
    size = len(text.encode())
    if size > LARGEST:
        raise StorageError(
            f"{path}: {size / 1e6:.0f} MB, allowed are {LARGEST / 1e6:.0f}: choose fewer runs"
        )
    write_text(text, path, with_checksum=False)


def page(packed: Sequence[dict]) -> str:
    """The whole page of packed scenes."""
    parts = {
        "STYLE": _read("viewer.css"),
        "SCRIPT": _read("viewer.js"),
        "SCENES": safe_json(packed),
    }
    parts |= {"PACKED": _read("packed.js", "live"), "DRAWING": _read("drawing.js", "live")}
    return filled(_read("viewer.html"), parts)


def _read(name: str, folder: str = "viewer") -> str:
    return files(f"pdrom.report.{folder}").joinpath(name).read_text(encoding="utf-8")
