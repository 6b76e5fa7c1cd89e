"""Sampling of projections: which entries or elements are evaluated, and the interpolation."""

from pdrom.reduction.sampling.reduction import Reduction, Sampling, reductions, select, select_path

__all__ = ["Reduction", "Sampling", "reductions", "select", "select_path"]
