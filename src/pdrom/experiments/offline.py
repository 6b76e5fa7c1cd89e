"""Time of the algorithms that run before a reduced model does, at full size."""

import logging
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Annotated, Any, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from pdrom.artifact.reads import Setting
from pdrom.core.paths import OFFLINE, File
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.kit.declaration import experiment
from pdrom.experiments.kit.settings import Tolerance
from pdrom.model.effects.base import Seed
from pdrom.reduction.basis.pod import pod
from pdrom.reduction.sampling.deim import deim_entries
from pdrom.reduction.sampling.qdeim import qdeim_elements
from pdrom.reduction.subspace.nnls import nnls_path

log = logging.getLogger(__name__)

COLUMNS = ["task", "implementation", "rows", "columns", "seconds", "difference"]
Task = Callable[[], np.ndarray]


class Offline(ConfigModel):
    """Section ``offline``: sizes of the algorithms that are timed, on random matrices.

    POD of ``rows`` x ``snapshots``, interpolation with ``r`` modes of it, non-negative least
    squares with ``elements`` columns and ``equations`` rows to ``tolerance``.
    """

    rows: Annotated[int, Field(ge=10, le=10_000_000)] = 100_000
    snapshots: Annotated[int, Field(ge=2, le=5000)] = 200
    r: Annotated[int, Field(ge=1, le=5000)] = 200
    elements: Annotated[int, Field(ge=10, le=10_000_000)] = 100_000
    equations: Annotated[int, Field(ge=2, le=20_000)] = 1000
    tolerance: Tolerance = 1e-3
    seed: Seed = 0

    @model_validator(mode="after")
    def _modes_exist(self) -> Self:
        if self.r > min(self.snapshots, self.rows):
            raise ValueError(f"r = {self.r}: at most snapshots = {self.snapshots} and rows")
        return self

    def small(self) -> Self:
        """Sizes that load and compile what a measurement needs."""
        sizes = ("snapshots", "r", "elements", "equations")
        changes = {name: min(getattr(self, name), 40) for name in sizes}
        return self.model_copy(update={**changes, "rows": 80})


@experiment(
    "Cost of the offline algorithms",
    reads={"sizes": Setting("offline")},
    writes={"out": OFFLINE},
    alone=True,
)
def offline(sizes: Offline, out: File) -> None:
    """Time every algorithm at the ``sizes`` of the section and write the table ``out``."""
    for _, *tasks in _tasks(sizes.small()):
        for task in filter(None, tasks):
            task()
    rows = []
    for labels, own, other in _tasks(sizes):
        seconds, result = _timed(own)
        row = {**labels, "implementation": "pdrom", "seconds": seconds}
        if other is not None:
            other_seconds, reference = _timed(other)
            row["difference"] = _difference(result, reference)
            rows.append({**labels, "implementation": "pymor", "seconds": other_seconds})
        rows.append(row)
        log.info("%s: %.2f s", labels["task"], seconds)
    table = pd.DataFrame(rows, columns=COLUMNS)
    ordered = table.sort_values(["task", "implementation"], kind="stable")
    write_table(ordered, out.path)


def _timed(task: Task) -> tuple[float, np.ndarray]:
    started = perf_counter()
    result = task()
    return perf_counter() - started, result


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    """Relative difference of numbers; of indices the share that is not in both."""
    if a.dtype.kind == "i":
        return 1.0 - len(np.intersect1d(a, b)) / len(b)
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def _tasks(sizes: Offline) -> Iterator[tuple[dict[str, Any], Task, Task | None]]:
    """Labels, our algorithm and pyMOR's (None: it has none), on the same input."""
    generator = np.random.default_rng(sizes.seed)
    n, m = sizes.rows, sizes.snapshots
    matrix = decaying(generator, n, m)
    size = {"rows": n, "columns": m}
    yield {"task": "pod", **size}, lambda: pod(matrix)[1], lambda: _pymor_pod(matrix)
    basis = pod(matrix)[0][:, : sizes.r]
    size = {"rows": n, "columns": basis.shape[1]}
    yield {"task": "deim", **size}, lambda: deim_entries(basis), lambda: _pymor_deim(basis)
    yield {"task": "q-deim", **size}, lambda: qdeim_elements(basis, 1), None
    columns = decaying(generator, sizes.elements, sizes.equations).T
    target = columns.sum(axis=1)
    size = {"rows": sizes.equations, "columns": sizes.elements}
    tolerance = sizes.tolerance
    yield {"task": "nnls", **size}, lambda: nnls_path(columns, target, [tolerance])[0][0], None


def decaying(generator: np.random.Generator, n: int, m: int, rate: float = 1e-8) -> np.ndarray:
    """Matrix (n, m), drawn by ``generator``, with singular values from about 1 to ``rate``."""
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
