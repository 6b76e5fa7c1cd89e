"""Drawing a figure and writing it as PDF and PNG: the same bytes every time."""

import logging
import os
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pdrom.core.store import atomic_path
from pdrom.view import style
from study.artifact.artifact import Artifact
from study.figures.kit.options import Options
from study.figures.kit.results import NothingToDraw, Results

log = logging.getLogger(__name__)

PNG_DPI = 200
RASTER_DPI = 300  # of rasterised artists inside a PDF
FULL_STUDY = "the full study (config/default.yaml) draws it"


def draw_figure(
    declared: Artifact, results: Results, options: Options, full: bool = True
) -> Figure:
    """Draw a figure as ``declared``, or a note where ``results`` hold nothing for its ``options``.

    ``full`` says that the configuration is that of the full study. Raises StorageError for a
    file that is missing or damaged.
    """
    with style.look():
        try:
            drawn: Figure = declared.function(results, options)
            return drawn
        except NothingToDraw as nothing:
            log.info("figure %s: %s", declared.name, nothing)
            elsewhere = "" if full else f"\n{FULL_STUDY}"
            return style.note(f"no data in this configuration: {nothing}{elsewhere}")


def write_figure(
    figure: Figure,
    title: str,
    pdf: str | os.PathLike[str],
    png: str | os.PathLike[str],
    with_checksum: bool = True,
) -> None:
    """Write ``figure`` as ``pdf`` (embedded TrueType fonts, no dates) and as its twin ``png``.

    The PDF has a ``title``.

    Either file appears only when complete. ``with_checksum`` as in `pdrom.core.store.atomic_path`.
    """
    FigureCanvasAgg(figure)
    document = {"Title": title, "Creator": "pdrom", "CreationDate": None, "ModDate": None}
    with style.look():
        with atomic_path(Path(pdf), with_checksum) as temporary:
            figure.savefig(temporary, format="pdf", dpi=RASTER_DPI, metadata=document)
        with atomic_path(Path(png), with_checksum) as temporary:
            figure.savefig(temporary, format="png", dpi=PNG_DPI, metadata={"Title": title})
