"""Bases of projection snapshots: weighting, centring, POD, numerical rank."""

from pdrom.reduction.basis.compute import compute_basis
from pdrom.reduction.basis.types import Basis, load_basis, save_basis

__all__ = ["Basis", "compute_basis", "load_basis", "save_basis"]
