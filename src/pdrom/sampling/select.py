"""From a method's specification to its sampling."""

from collections.abc import Sequence

import numpy as np

from pdrom.basis.types import Basis
from pdrom.method import MethodSpec
from pdrom.sampling.block import block_elements
from pdrom.sampling.block_qdeim import block_qdeim_elements
from pdrom.sampling.deim import deim_entries
from pdrom.sampling.joint import joint_rows
from pdrom.sampling.oversample import extend_elements
from pdrom.sampling.qdeim import qdeim_entries
from pdrom.sampling.types import Sampling


def select(basis: Basis, spec: MethodSpec, r: int) -> Sampling:
    """Sampling of ``spec`` for the first r modes of ``basis``."""
    return select_path(basis, spec, [r])[r]


def select_path(basis: Basis, spec: MethodSpec, ranks: Sequence[int]) -> dict[int, Sampling]:
    """Samplings for several r; greedy selections are nested and made once for the largest.

    Raises
    ------
    RankError
        If an r is below 1 or exceeds the numerical rank of the basis.
    """
    if not ranks:
        return {}
    basis.truncated(min(ranks))
    v = basis.truncated(max(ranks))
    if spec.rows == "all":
        everything = Sampling.of_elements(
            np.arange(basis.elements), basis.rows_per_element, basis.elements
        )
        return dict.fromkeys(ranks, everything)
    if spec.rows == "element":
        return _element_path(basis, spec, v, ranks)
    if spec.rows == "joint":
        path = 3 * joint_rows(v, basis.active_axes, spec.repeat_rows)
        return {r: _of_entries(path[:r], basis, spec) for r in ranks}
    if spec.selection == "greedy":
        path = deim_entries(v)
        return {r: _of_entries(path[:r], basis, spec) for r in ranks}
    return {r: _of_entries(qdeim_entries(v[:, :r]), basis, spec) for r in ranks}


def _element_path(
    basis: Basis, spec: MethodSpec, v: np.ndarray, ranks: Sequence[int]
) -> dict[int, Sampling]:
    size = 3 * basis.rows_per_element
    if spec.selection == "greedy":
        path = block_elements(v, size)
        chosen = {
            r: extend_elements(v[:, :r], size, path[:r], spec.oversampling * r) for r in ranks
        }
    else:
        chosen = {r: block_qdeim_elements(v[:, :r], size) for r in ranks}
    counts = (basis.rows_per_element, basis.elements)
    return {r: Sampling.of_elements(elements, *counts) for r, elements in chosen.items()}


def _of_entries(entries: np.ndarray, basis: Basis, spec: MethodSpec) -> Sampling:
    return Sampling.of_entries(
        entries, basis.rows_per_element, basis.elements, repeats=spec.repeat_rows
    )
