"""The page on which reduced models run: one file, and beside it a file of models for each scene."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

from pdrom.artifact.artifact import declare
from pdrom.artifact.files import Files
from pdrom.artifact.reads import Every, ProjectFile
from pdrom.core.errors import StorageError
from pdrom.core.paths import LIVE_MODEL, LIVE_PAGE, File
from pdrom.core.store import read_text, write_text

# Folder of the models, from that of the page.
MODELS = Path(LIVE_MODEL.pattern).parent.name
HEAD = re.compile(r'pdromLive\(\{"format":1,"scene":("\w+"),"title":("(?:[^"\\]|\\.)*"),')


def _write(models: list[File], html: Path, outputs: Mapping[str, str], **parts: Path) -> None:
    """Write the page of its ``parts``; it loads the models of a scene when a reader chooses it.

    Raises
    ------
    StorageError
        A file of models is damaged, or none.
    """
    texts = {name.upper(): path.read_text("utf-8") for name, path in parts.items()}
    texts["SCENES"] = safe_json([_listed(file) for file in models])
    write_text(filled(html.read_text("utf-8"), texts), outputs["out"])


def _listed(file: File) -> dict[str, str]:
    head = HEAD.match(read_text(file.path))
    if head is None:
        raise StorageError(f"{file.path}: no models for the page, or of another version")
    scene, title = map(json.loads, head.groups())
    return {"scene": scene, "title": title, "file": f"{MODELS}/{Path(file.path).name}"}


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


def _asset(name: str) -> ProjectFile:
    return ProjectFile(f"src/pdrom/report/live/{name}")


live_page = declare(
    Files(
        "live_page",
        "Page on which models run",
        {
            "models": Every(LIVE_MODEL),
            "html": _asset("live.html"),
            "style": _asset("live.css"),
            "packed": _asset("packed.js"),
            "engine": _asset("engine.js"),
            "drawing": _asset("drawing.js"),
            "script": _asset("live.js"),
        },
        {"out": LIVE_PAGE},
        _write,
    ),
    "outputs",
)
