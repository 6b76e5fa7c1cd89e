"""Web page on which reduced models run: one HTML file, and a file of models for each scene."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

from pdrom.core.errors import StorageError
from pdrom.core.store import read_text, write_text
from pdrom.view.page import LIVE, page_of
from study.artifact.artifact import Artifact
from study.artifact.paths import LIVE_MODEL, LIVE_PAGE, File
from study.artifact.reads import Every, ProjectFile

# Folder of the model files, relative to the page.
MODELS = Path(LIVE_MODEL.pattern).parent.name
HEAD = re.compile(r'pdromLive\(\{"format":1,"scene":("\w+"),"title":("(?:[^"\\]|\\.)*"),')


def _write(models: list[File], outputs: Mapping[str, str], parts: list[Path]) -> None:
    """Write the page with a list of the scenes of ``models``."""
    scenes = [scene for file in models if (scene := _listed(file))]
    write_text(page_of(LIVE, scenes), outputs["out"])


def _listed(file: File) -> dict[str, str] | None:
    """Entry of the page's list of scenes for a file of models; None if the file has no models."""
    text = read_text(file.path)
    if '"models":[]' in text:
        return None
    head = HEAD.match(text)
    if head is None:
        raise StorageError(f"{file.path}: no models for the page, or of another version")
    scene, title = map(json.loads, head.groups())
    return {"scene": scene, "title": title, "file": f"{MODELS}/{Path(file.path).name}"}


live_page = Artifact(
    "live_page",
    "Page on which models run",
    {
        "models": Every(LIVE_MODEL),
        "parts": ProjectFile(tuple(f"src/pdrom/view/{name}" for name in LIVE)),
    },
    {"out": LIVE_PAGE},
    _write,
)
