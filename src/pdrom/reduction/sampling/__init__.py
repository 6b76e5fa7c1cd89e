"""Sampling of projections: which entries or elements are evaluated, and the interpolation."""

from pdrom.reduction.sampling.reduction import Reduction
from pdrom.reduction.sampling.select import select, select_path
from pdrom.reduction.sampling.types import Sampling

__all__ = ["Reduction", "Sampling", "select", "select_path"]
