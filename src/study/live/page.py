"""Web page that simulates reduced models: one HTML file, and a file of models per scene."""

from collections.abc import Mapping
from pathlib import Path

from pdrom.core.store import read_text, write_text
from pdrom.view.page import LIVE, page_of
from study.artifact.artifact import Artifact
from study.artifact.paths import LIVE_MODEL, LIVE_PAGE, File
from study.artifact.reads import Every, ProjectFile
from study.artifact.words import scene


def _write(models: list[File], outputs: Mapping[str, str], parts: list[Path]) -> None:
    """Write the page with a list of the scenes for which ``models`` has at least one model."""
    scenes = [
        {"scene": (name := file["scene"]), "words": scene(name), "file": f"live/{name}.js"}
        for file in models
        if '"models":[]' not in read_text(file.path)
    ]
    write_text(page_of(LIVE, scenes), outputs["out"])


live_page = Artifact(
    "live_page",
    "Page that simulates reduced models",
    {
        "models": Every(LIVE_MODEL),
        "parts": ProjectFile(tuple(f"src/pdrom/view/{name}" for name in LIVE)),
    },
    {"out": LIVE_PAGE},
    _write,
)
