"""Figures of the paper: what each one draws (`spec`), reads (`catalogue`) and how it looks.

Importing this package loads no plotting library; the modules that draw are loaded on demand.
"""

from pdrom.report.figures.catalogue import FIGURES, figure_inputs
from pdrom.report.figures.sources import Holdings, Sources
from pdrom.report.figures.spec import FigureSpec, load_figures

__all__ = ["FIGURES", "FigureSpec", "Holdings", "Sources", "figure_inputs", "load_figures"]
