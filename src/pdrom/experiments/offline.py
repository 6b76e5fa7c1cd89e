"""Rule offline: time of the algorithms that run before a reduced model does, at full size."""

import logging
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from pdrom.core.store import write_table
from pdrom.reduction.basis.pod import pod
from pdrom.reduction.sampling.deim import deim_entries
from pdrom.reduction.sampling.qdeim import qdeim_entries
from pdrom.reduction.subspace.nnls import nnls_early_stop

log = logging.getLogger(__name__)

COLUMNS = ["task", "implementation", "rows", "columns", "seconds", "difference"]
Task = Callable[[], np.ndarray]


def measure_offline(settings: dict[str, Any], output: str) -> None:
    """Write the table offline_cost: each algorithm, pyMOR's beside it where it has one.

    Parameters
    ----------
    settings : rows and snapshots of the matrix, r of the interpolation, elements and equations of
        the non-negative least squares with their tolerance, seed
    """
    small = {name: min(int(size), 40) for name, size in settings.items() if name != "tolerance"}
    for _, *tasks in _tasks({**small, "tolerance": settings["tolerance"], "rows": 80}):
        for task in filter(None, tasks):
            task()  # loads and compiles what the measurement needs
    rows = []
    for labels, own, other in _tasks(settings):
        seconds, result = _timed(own)
        row = {**labels, "implementation": "pdrom", "seconds": seconds}
        if other is not None:
            other_seconds, reference = _timed(other)
            row["difference"] = _difference(result, reference)
            rows.append({**labels, "implementation": "pymor", "seconds": other_seconds})
        rows.append(row)
        log.info("%s: %.2f s", labels["task"], seconds)
    table = pd.DataFrame(rows, columns=COLUMNS)
    write_table(table.sort_values(["task", "implementation"], kind="stable"), output)


def _timed(task: Task) -> tuple[float, np.ndarray]:
    started = perf_counter()
    result = task()
    return perf_counter() - started, result


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    """Relative difference of numbers; of indices the share that is not in both."""
    if a.dtype.kind == "i":
        return 1.0 - len(np.intersect1d(a, b)) / len(b)
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def _tasks(settings: dict[str, Any]) -> Iterator[tuple[dict[str, Any], Task, Task | None]]:
    """Labels, our algorithm and pyMOR's (None: it has none), on the same input."""
    generator = np.random.default_rng(settings["seed"])
    n, m, r = settings["rows"], settings["snapshots"], settings["r"]
    matrix = decaying(generator, n, m)
    size = {"rows": n, "columns": m}
    yield {"task": "pod", **size}, lambda: pod(matrix)[1], lambda: _pymor_pod(matrix)
    basis = pod(matrix)[0][:, :r]
    size = {"rows": n, "columns": basis.shape[1]}
    yield {"task": "deim", **size}, lambda: deim_entries(basis), lambda: _pymor_deim(basis)
    yield {"task": "q-deim", **size}, lambda: qdeim_entries(basis), None
    elements, equations = settings["elements"], settings["equations"]
    columns = decaying(generator, elements, equations).T
    target = columns.sum(axis=1)
    size = {"rows": equations, "columns": elements}
    tolerance = settings["tolerance"]
    yield {"task": "nnls", **size}, lambda: nnls_early_stop(columns, target, tolerance)[0], None


def decaying(generator: np.random.Generator, n: int, m: int, rate: float = 1e-8) -> np.ndarray:
    """Random matrix (n, m) whose singular values decay from about 1 to ``rate``."""
    factors = np.geomspace(1.0, rate, m)
    return generator.standard_normal((n, m)) / np.sqrt(n) * factors


def _quiet() -> None:
    """pyMOR writes a line for every interpolation point."""
    from pymor.core.logger import set_log_levels

    set_log_levels({"pymor": "WARN"})


def _pymor_pod(matrix: np.ndarray) -> np.ndarray:
    from pymor.algorithms.pod import pod as pymor_pod
    from pymor.vectorarrays.numpy import NumpyVectorSpace

    _quiet()
    vectors = NumpyVectorSpace(len(matrix)).from_numpy(matrix)
    _, sigma = pymor_pod(vectors, method="qr_svd", rtol=0.0, atol=0.0)
    return sigma


def _pymor_deim(basis: np.ndarray) -> np.ndarray:
    from pymor.algorithms.ei import deim
    from pymor.vectorarrays.numpy import NumpyVectorSpace

    _quiet()
    vectors = NumpyVectorSpace(len(basis)).from_numpy(basis)
    return np.asarray(deim(vectors, pod=False)[0])
