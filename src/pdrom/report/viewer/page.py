"""Writing the page: the library's script, ours, and the runs, in one file."""

import json
import os
from collections.abc import Sequence
from importlib.resources import files

from plotly.offline import get_plotlyjs

from pdrom.core.errors import StorageError
from pdrom.core.store import write_text
from pdrom.report.viewer.pack import pack_scene
from pdrom.report.viewer.runs import ViewedScene

LARGEST = 25_000_000  # bytes


def write_page(
    scenes: Sequence[ViewedScene], path: str | os.PathLike[str], with_checksum: bool = True
) -> None:
    """Write the viewer of some scenes; the library's licence stands in its script.

    ``with_checksum`` as in `pdrom.core.store.atomic_path`.

    Raises
    ------
    StorageError
        The page would be larger than a browser opens with ease.
    """
    text = page([pack_scene(scene) for scene in scenes])
    size = len(text.encode())
    if size > LARGEST:
        raise StorageError(
            f"{path}: {size / 1e6:.0f} MB, allowed are {LARGEST / 1e6:.0f}: choose fewer scenes, "
            "methods or sizes (keys viewer.scenes, methods, viewer.ranks)"
        )
    write_text(text, path, with_checksum)


def page(packed: Sequence[dict]) -> str:
    """The whole page of packed scenes."""
    parts = {
        "STYLE": _own("viewer.css"),
        "LIBRARY": get_plotlyjs(),
        "SCRIPT": _own("viewer.js"),
        # no text ends the element that holds it, or opens a comment in which its end is none
        "SCENES": json.dumps(packed, separators=(",", ":"), allow_nan=False).replace(
            "<", "\\u003c"
        ),
    }
    before, *rest = _own("viewer.html").split("{{")
    pieces = [before]
    for piece in rest:
        name, _, after = piece.partition("}}")
        pieces += [parts[name], after]
    return "".join(pieces)


def _own(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
