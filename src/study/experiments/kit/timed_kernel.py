"""A local kernel that is timed inside the compiled loop."""

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.clock import clock, now
from pdrom.model.constraints.local_kernel import OWN, PREPARE, LocalKernel, call, local_kernel

# Entries of the record: address and record of the kernel, the places of the seconds and clocks of
# its two parts and of its preparation.
KERNEL, RECORD, SECONDS, CLOCKS, SIZE = range(OWN, OWN + 5)


@local_kernel
def _timed(y, rhs, record, part):
    entries = rows.indices(record, SIZE)
    watch = rows.indices(entries[CLOCKS] + 16 * part, 2)
    before = now(watch)
    energy = call(entries[KERNEL], y, rhs, entries[RECORD], part)
    rows.doubles(entries[SECONDS], PREPARE + 1)[part] += now(watch) - before
    return energy


def timed(kernel: LocalKernel) -> tuple[LocalKernel, np.ndarray]:
    """A kernel that does the same, and the seconds (3,) that its parts and preparation took."""
    seconds, clocks = np.zeros(PREPARE + 1), np.stack([clock() for _ in range(PREPARE + 1)])
    arrays = (seconds, clocks)
    places = [kernel.address, kernel.record.ctypes.data, *(array.ctypes.data for array in arrays)]
    record = np.concatenate([kernel.record[:OWN], np.array(places, dtype=np.int64)])
    kept = (*arrays, kernel.record, *kernel.arrays)
    return LocalKernel(_timed, record, kept, kernel.prepares, kernel.touched), seconds
