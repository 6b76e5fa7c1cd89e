"""Drawing a figure and writing it as PDF and PNG: the same bytes every time."""

import logging
import os
from importlib import import_module
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pdrom.core.embedded import PDF_KEY, PNG_KEY
from pdrom.core.provenance import as_text, provenance
from pdrom.core.store import atomic_path
from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.catalogue import modules
from pdrom.report.figures.kit.options import Options
from pdrom.report.figures.kit.results import NothingToDraw, Results

log = logging.getLogger(__name__)

PNG_DPI = 200
RASTER_DPI = 300  # of rasterised artists inside a PDF
FULL_STUDY = "the full study (config/default.yaml) draws it"


def draw_figure(name: str, results: Results, options: Options, full: bool = True) -> Figure:
    """Figure ``name``, or a note where the configuration holds nothing of what it shows.

    ``full`` says that the configuration is that of the full study. Raises ConfigurationError for an
    unknown figure, StorageError for a file that is missing or damaged.
    """
    drawing = import_module(modules(name)[1])
    with style.look():
        try:
            return drawing.draw(results, options)
        except NothingToDraw as nothing:
            log.info("figure %s: %s", name, nothing)
            elsewhere = "" if full else f"\n{FULL_STUDY}"
            return style.note(f"no data in this configuration: {nothing}{elsewhere}")


def write_figure(
    figure: Figure,
    title: str,
    pdf: str | os.PathLike[str],
    png: str | os.PathLike[str],
    sealed: bool = True,
) -> None:
    """Write ``figure`` as PDF (embedded TrueType fonts, no dates) and as its PNG twin.

    Both carry their provenance (`pdrom.core.embedded`). Either file appears only when complete.
    ``sealed`` as in `pdrom.core.store.atomic_path`.
    """
    FigureCanvasAgg(figure)
    made = as_text(provenance())
    document = {"Title": title, "Creator": "pdrom", "CreationDate": None, "ModDate": None}
    with style.look():
        with atomic_path(Path(pdf), sealed) as temporary:
            figure.savefig(
                temporary, format="pdf", dpi=RASTER_DPI, metadata=document | {PDF_KEY: made}
            )
        with atomic_path(Path(png), sealed) as temporary:
            picture = {"Title": title, PNG_KEY: made}
            figure.savefig(temporary, format="png", dpi=PNG_DPI, metadata=picture)
