"""Sampling of projections: which entries or elements are evaluated, and the interpolation."""

from pdrom.sampling.reduction import Reduction
from pdrom.sampling.select import select, select_path
from pdrom.sampling.types import Sampling

__all__ = ["Reduction", "Sampling", "select", "select_path"]
