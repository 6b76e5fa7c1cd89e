"""Writing a figure as PDF and PNG: the same bytes every time."""

import logging
import os
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pdrom.core.store import atomic_path
from pdrom.report.figures import style
from pdrom.report.figures.catalogue import FIGURES
from pdrom.report.figures.sources import Sources
from pdrom.report.figures.spec import FigureSpec

log = logging.getLogger(__name__)

PNG_DPI = 200
RASTER_DPI = 300  # of rasterised artists inside a PDF


def draw_figure(name: str, sources: Sources, spec: FigureSpec) -> Figure:
    """Figure ``name``; ConfigurationError for an unknown one, StorageError for missing files."""
    return FIGURES.load(name)(sources, spec)


def make_figure(
    name: str,
    sources: Sources,
    spec: FigureSpec,
    pdf: str | os.PathLike[str],
    png: str | os.PathLike[str],
) -> None:
    """Draw figure ``name`` and write both of its files."""
    write_figure(draw_figure(name, sources, spec), spec.title, pdf, png)
    log.info("figure %s written", name)


def write_figure(
    figure: Figure, title: str, pdf: str | os.PathLike[str], png: str | os.PathLike[str]
) -> None:
    """Write ``figure`` as PDF (embedded TrueType fonts, no dates) and as its PNG twin.

    Either file appears only when complete.
    """
    FigureCanvasAgg(figure)
    metadata = {"Title": title, "Creator": "pdrom", "CreationDate": None, "ModDate": None}
    with style.look():
        with atomic_path(Path(pdf)) as temporary:
            figure.savefig(temporary, format="pdf", dpi=RASTER_DPI, metadata=metadata)
        with atomic_path(Path(png)) as temporary:
            figure.savefig(temporary, format="png", dpi=PNG_DPI, metadata={"Title": title})
