"""Bases of projection snapshots: weighting, centring, POD, numerical rank."""

from pdrom.reduction.basis.compute import basis_of, compute_basis
from pdrom.reduction.basis.types import Basis, load_basis, save_basis

__all__ = ["Basis", "basis_of", "compute_basis", "load_basis", "save_basis"]
