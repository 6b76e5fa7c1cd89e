"""Sampling of projections: selection of entries or elements, and interpolation from them."""

from pdrom.reduction.sampling.reduction import Reduction, Sampling, reductions, select, select_path

__all__ = ["Reduction", "Sampling", "reductions", "select", "select_path"]
