"""Sampling of a method, from its specification."""

from collections.abc import Sequence

import numpy as np

from pdrom.reduction.basis import Basis
from pdrom.reduction.method import SELECTIONS, MethodSpec
from pdrom.reduction.sampling.deim import Selection, joint_rows
from pdrom.reduction.sampling.gappy_pod_e import bound_gain
from pdrom.reduction.sampling.reduction import Reduction, Sampling


def select(basis: Basis, spec: MethodSpec, r: int) -> Sampling:
    """Sampling of ``spec`` for the first r modes of ``basis``."""
    return select_path(basis, spec, [r])[r]


def select_path(basis: Basis, spec: MethodSpec, ranks: Sequence[int]) -> dict[int, Sampling]:
    """Samplings of ``basis`` by ``spec`` for several ``ranks``, nested where they are greedy.

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
    if spec.rows == "joint":
        path = joint_rows(v, basis.active_axes, spec.repeat_rows)
        rows = {r: _extended(v[:, :r], 3, path[:r], spec, r) for r in ranks}
        return {r: _of_entries(3 * own, basis, spec) for r, own in rows.items()}
    if spec.rows == "element":
        counts = (basis.rows_per_element, basis.elements)
        chosen = _sampled_blocks(v, 3 * basis.rows_per_element, spec, ranks)
        return {r: Sampling.of_elements(elements, *counts) for r, elements in chosen.items()}
    chosen = _sampled_blocks(v, 1, spec, ranks)
    return {r: _of_entries(entries, basis, spec) for r, entries in chosen.items()}


def reductions(basis: Basis, spec: MethodSpec, sizes: Sequence[int]) -> dict[int, Reduction]:
    """Reductions of those of ``sizes`` that ``basis`` has, by ``spec``; see `select_path`."""
    known = [r for r in sizes if r <= basis.rank]
    path = select_path(basis, spec, known)
    return {r: Reduction(basis, path[r], spec, r=r) for r in known}


def _sampled_blocks(
    v: np.ndarray, size: int, spec: MethodSpec, ranks: Sequence[int]
) -> dict[int, np.ndarray]:
    """Blocks of ``size`` rows (elements, or entries for size 1) for every r: one a mode, then more.

    Blocks beyond the modes are not nested in r: they depend on where the first r modes are weak.
    """
    selection: Selection = SELECTIONS.load(spec.selection)()
    chosen = {}
    for r, start in selection.one_a_mode(v, size, ranks).items():
        start = _extended(v[:, :r], size, start, spec, r)
        if spec.gain_bound is not None:
            start = bound_gain(v[:, :r], size, start, bound=spec.gain_bound)
        chosen[r] = start
    return chosen


def _extended(v: np.ndarray, size: int, start: np.ndarray, spec: MethodSpec, r: int) -> np.ndarray:
    """Blocks ``start`` and as many more as the method's oversampling of r modes asks for."""
    if spec.oversampling == 1:
        return start
    selection: Selection = SELECTIONS.load(spec.selection)()
    return selection.extend(v, size, start, min(spec.oversampling * r, len(v) // size))


def _of_entries(entries: np.ndarray, basis: Basis, spec: MethodSpec) -> Sampling:
    return Sampling.of_entries(
        entries, basis.rows_per_element, basis.elements, repeats=spec.repeat_rows
    )
