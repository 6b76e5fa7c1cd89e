"""Writing the page: scripts and runs in one file."""

import json
import os
from collections.abc import Sequence
from importlib.resources import files

from pdrom.core.errors import StorageError
from pdrom.core.store import write_text
from pdrom.view.pack import pack_scene
from pdrom.view.runs import ViewedScene

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
    parts |= {"PACKED": _read("packed.js"), "DRAWING": _read("drawing.js")}
    return filled(_read("viewer.html"), parts)


def _read(name: str) -> str:
    return files("pdrom.view").joinpath(name).read_text(encoding="utf-8")


def safe_json(value: object) -> str:
    """JSON of ``value`` in which no text ends the element that holds it, or opens a comment."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def filled(template: str, parts: dict[str, str]) -> str:
    """Return ``template`` with its ``{{NAME}}`` replaced by ``parts``, which are not looked at."""
    before, *rest = template.split("{{")
    pieces = [before]
    for piece in rest:
        name, _, after = piece.partition("}}")
        pieces += [parts[name], after]
    return "".join(pieces)
