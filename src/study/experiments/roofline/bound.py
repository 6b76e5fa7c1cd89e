"""The least time that a machine with given rates needs for given work."""

import numpy as np
import pandas as pd

from pdrom.model.compiled.rows import WIDTH

# what rates are measured of
READ, FLOPS, DIVISIONS, ROOTS = "bytes read", "sums and products", "divisions", "square roots"
# what may decide
MEMORY, ARITHMETIC, DIVIDER = "bytes", "sums and products", "divisions and roots"


def bounds(work: pd.DataFrame, rates: pd.DataFrame) -> pd.DataFrame:
    """Columns ``bandwidth`` (1e9 B/s), ``bound_us`` and ``limit`` (what decides) for rows of work.

    Sums and products, and divisions with roots (which share a unit of the processor), need their
    times at the measured rates, bytes theirs at the `bandwidth` of the iteration's working set, and
    the vectors that gathers and scatters load and store theirs at the rate of the nearest cache.
    All three may overlap, so the longest is the bound. Shuffles and waiting are not in it. Of the
    bytes it is one of the iteration: a phase whose arrays the cache happens to prefer can be
    somewhat faster.
    """
    speed = rates.set_index("quantity").rate
    read = rates[rates.quantity == READ]
    nearest = read.rate[read.working_set.idxmin()]
    rate = bandwidth(work.working_set.to_numpy(float), read)
    times = pd.DataFrame(
        {
            MEMORY: work.bytes / rate + 8 * WIDTH * work.touches / nearest,
            ARITHMETIC: work.flops / speed[FLOPS],
            DIVIDER: work.divisions / speed[DIVISIONS] + work.roots / speed[ROOTS],
        }
    )
    decides = times.idxmax(axis=1)
    return pd.DataFrame({"bandwidth": rate, "bound_us": 1e-3 * times.max(axis=1), "limit": decides})


def bandwidth(working_set: np.ndarray, read: pd.DataFrame) -> np.ndarray:
    """Best rates (n,), 1e9 B/s, of going through sets of ``working_set`` (n,) bytes over and over.

    The rates ``read`` are those of plain repeated reading, which leaves nothing in a cache that is
    too small for it. At best a part S of the working set W stays where it is read as fast as a set
    of that size, and the rest comes at the speed of W: the time of a byte is the least over S of
    (S / W) t(S) + (1 - S / W) t(W). Rates between measured sizes are interpolated.
    """
    read = read.sort_values("working_set")
    sizes, seconds = read.working_set.to_numpy(float), 1.0 / read.rate.to_numpy(float)
    whole = np.exp(np.interp(np.log(working_set), np.log(sizes), np.log(seconds)))
    part = np.minimum(sizes / working_set[:, None], 1.0)
    kept = np.where(sizes < working_set[:, None], seconds, whole[:, None])
    return 1.0 / (part * kept + (1.0 - part) * whole[:, None]).min(axis=1)
