"""Run a reduced model, make its table row, and store the run."""

from typing import Any

import h5py
import numpy as np

from pdrom.model.energy import largest
from pdrom.reduction.deviations import Reduced, Yardstick
from pdrom.reduction.rerun import Rerun

Row = dict[str, Any]


def run(
    full: Yardstick, model: Reduced, labels: Row, offset: np.ndarray | None = None
) -> tuple[Row, Rerun]:
    """Run ``model`` in the scene of ``full``; return the row (``labels``, results) and the run.

    Initial positions are displaced by ``offset`` (N, 3) m.
    """
    outcome = full.run(model, offset)
    return labels | full.row(outcome), outcome


def store_series(
    store: h5py.Group, full: Yardstick, outcome: Rerun, **series: np.ndarray
) -> float | None:
    """Store the deviations of a run from ``full``, and further ``series`` of its frames.

    Returns its largest energy relative to the full-order run; None if that is a rounding error.
    """
    apart = full.deviations(outcome)
    for name, values in {**apart, **series}.items():
        store[name] = values
    return largest(apart["energy"])


def store_end(store: h5py.Group, outcome: Rerun | None, r: int, every: int = 1) -> None:
    """Store the size r of a run, its end, and positions in single precision.

    Only frames whose number is a multiple of ``every`` are stored. If the attribute ``marked`` is
    True, the basis has fewer than r modes and the model was not run.
    """
    store.attrs.update(r=r, marked=outcome is None, every=every)
    if outcome is not None:
        blowup = -1 if outcome.blowup_frame is None else outcome.blowup_frame
        store.attrs.update(blowup_frame=blowup, max_extent=outcome.max_extent)
        store["positions"] = outcome.positions[::every].astype(np.float32)
