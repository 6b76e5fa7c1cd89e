"""Compiled part of the reduced local step: coefficients from sampled entries, and their
reconstruction ("lift").

Coefficients come in sets: one that all axes share, or one an axis. A column of the lift adds the
coefficients of its set to one axis of the right-hand side.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.clock import clock, now
from pdrom.model.compiled.dots import dots
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at
from pdrom.model.constraints.local_kernel import (
    FIRST,
    OWN,
    PARTS,
    PREPARE,
    VERTICES,
    LocalKernel,
    call,
    local_kernel,
)

SPLIT_FROM = 1 << 17  # entries of a lift (N, r) from which its rows are in two parts

# Entries of the record: the numbers of modes, sets, columns and sampled numbers, address and record
# of the sampler; then the places of the arrays of `Lift` in their order, and that of a clock.
MODES, SETS, COLUMNS, SAMPLED, SAMPLER, SAMPLER_RECORD = range(OWN, OWN + 6)
STARTS, POSITIONS, PACKED, OPERATORS, SHIFTS, COEFFICIENTS = range(OWN + 6, OWN + 12)
AXES, OWN_SETS, LIFTED, OFFSET, SECONDS, PROJECTIONS, CLOCK, SIZE = range(OWN + 12, OWN + 20)


@dataclass(frozen=True)
class Lift:
    """Arrays of a reduced local step, for r modes, N vertices and c columns.

    starts : (sets + 1,) where the sampled entries of each set begin
    positions : sampled entries of each set among the numbers of the sampled elements
    packed : room for those of one set
    operators : (r, m) of each set, flat, one after the other
    shifts : (sets, r) what is taken from operator times entries: the part of the mean
    coefficients : (sets, r) those of the last evaluation
    axes, own_sets : (c,) axis that a column adds to, set whose coefficients it takes
    lifted : (c, N, r) S^T W V
    offset : (4 N,) S^T W mean, padded vectors
    seconds : (2,) time of the two parts of the lift so far
    """

    starts: np.ndarray
    positions: np.ndarray
    packed: np.ndarray
    operators: np.ndarray
    shifts: np.ndarray
    coefficients: np.ndarray
    axes: np.ndarray
    own_sets: np.ndarray
    lifted: np.ndarray
    offset: np.ndarray
    seconds: np.ndarray

    @property
    def arrays(self) -> Sequence[np.ndarray]:
        """All of them, in the order of the kernel's record."""
        return tuple(getattr(self, name) for name in self.__dataclass_fields__)

    @property
    def split(self) -> bool:
        """Whether its rows are in two parts."""
        _, vertices, modes = self.lifted.shape
        return bool(vertices * modes >= SPLIT_FROM)

    def kernel(self, sampler: LocalKernel, sampled: int) -> LocalKernel:
        """Local kernel that adds the lift; ``sampler`` writes so many ``sampled`` numbers."""
        columns, vertices, modes = self.lifted.shape
        numbers = (
            modes, len(self.shifts), columns, sampled, sampler.address, sampler.record.ctypes.data
        )  # fmt: skip
        clocks = np.stack([clock(), clock()])
        arrays = (*self.arrays, np.empty(sampled), clocks, sampler.record, *sampler.arrays)
        return LocalKernel.of(
            _accumulate,
            vertices,
            units=vertices,
            arrays=arrays,
            numbers=numbers,
            touched=(lambda first: np.arange(first, vertices)) if self.split else None,
            prepares=True,
        )


@compiled(nogil=True)
def coefficients(sampled, starts, positions, packed, operators, shifts, result):
    """Write the coefficients of all sets that belong to the numbers of the sampled elements.

    Parameters
    ----------
    sampled : projections of the sampled elements, one after the other
    starts, positions, packed, operators, shifts : see `Lift`
    result : (sets, r) that is written
    """
    sets, modes = shifts.shape
    for k in range(sets):
        first, last = starts[k], starts[k + 1]
        # side by side, so that a product for each mode reads whole vectors
        for j in range(last - first):
            packed[j] = at(sampled, at(positions, first + j))
        size = last - first
        for i in range(0, modes, 3):
            # the last one again where there are fewer than three
            a, b, c = i, min(i + 1, modes - 1), min(i + 2, modes - 1)
            result[k, a], result[k, b], result[k, c] = dots(
                operators,
                first * modes + a * size,
                first * modes + b * size,
                first * modes + c * size,
                size,
                packed,
                (-shifts[k, a], -shifts[k, b], -shifts[k, c]),
            )


@compiled(nogil=True)
def lift(values, axes, own_sets, lifted, offset, first, last, rhs):
    """Add S^T W (mean + V c) to the rows ``first`` to ``last`` - 1 of the right-hand side.

    Parameters
    ----------
    values : (sets, r) coefficients
    axes, own_sets, lifted, offset : see `Lift`
    rhs : (4 N,) right-hand side, padded vectors
    """
    for i in range(WIDTH * first, WIDTH * last):
        rhs[i] += offset[i]
    columns, vertices, modes = lifted.shape
    flat = lifted.reshape(columns * vertices * modes)
    for column in range(columns):
        own, axis, start = values[own_sets[column]], axes[column], column * vertices
        for vertex in range(first, last - 2, 3):
            i = (start + vertex) * modes
            x, y, z = dots(flat, i, i + modes, i + 2 * modes, modes, own, (0.0, 0.0, 0.0))
            rhs[WIDTH * vertex + axis] += x
            rhs[WIDTH * (vertex + 1) + axis] += y
            rhs[WIDTH * (vertex + 2) + axis] += z
        for vertex in range(last - (last - first) % 3, last):
            i = (start + vertex) * modes
            rhs[WIDTH * vertex + axis] += dots(flat, i, i, i, modes, own, (0.0, 0.0, 0.0))[0]


@local_kernel
def _accumulate(y, rhs_place, record, part):
    entries = rows.indices(record, SIZE)
    modes, sets, columns = entries[MODES], entries[SETS], entries[COLUMNS]
    values = rows.doubles(entries[COEFFICIENTS], sets * modes).reshape((sets, modes))
    if part == PREPARE:
        starts = rows.indices(entries[STARTS], sets + 1)
        count = starts[sets]
        projections = entries[PROJECTIONS]
        call(entries[SAMPLER], y, projections, entries[SAMPLER_RECORD], PARTS[0])
        coefficients(
            rows.doubles(projections, entries[SAMPLED]),
            starts,
            rows.indices(entries[POSITIONS], count),
            rows.doubles(entries[PACKED], count),
            rows.doubles(entries[OPERATORS], count * modes),
            rows.doubles(entries[SHIFTS], sets * modes).reshape((sets, modes)),
            values,
        )
        return 0.0
    vertices = entries[VERTICES]
    watch = rows.indices(entries[CLOCK] + 16 * part, 2)
    before = now(watch)
    lift(
        values,
        rows.indices(entries[AXES], columns),
        rows.indices(entries[OWN_SETS], columns),
        rows.doubles(entries[LIFTED], columns * vertices * modes).reshape(
            (columns, vertices, modes)
        ),
        rows.doubles(entries[OFFSET], WIDTH * vertices),
        entries[FIRST + part],
        entries[FIRST + part + 1],
        rows.doubles(rhs_place, WIDTH * vertices),
    )
    rows.doubles(entries[SECONDS], 2)[part] += now(watch) - before
    return np.nan
