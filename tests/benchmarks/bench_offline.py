"""Offline algorithms, each beside what it replaced: reflections, the loop, LAPACK's pivots."""

import numpy as np
import pytest
from scipy import linalg

from pdrom.reduction.basis import pod
from pdrom.reduction.sampling.deim import block_elements, deim_entries, joint_rows, tie_weights
from pdrom.reduction.sampling.qdeim import qdeim_elements
from pdrom.reduction.sampling.s_opt import s_opt_path

# a sheet's strains, the bar of the study, and a size that no scene has
SIZES = {"2166x100": (2166, 100), "28080x70": (28_080, 70), "100000x200": (100_000, 200)}
ROUNDS = {"2166x100": 20, "28080x70": 5, "100000x200": 3}


def decaying(generator: np.random.Generator, n: int, m: int, rate: float = 1e-8) -> np.ndarray:
    """Matrix (n, m) with singular values from about 1 to ``rate``."""
    factors = np.geomspace(1.0, rate, m)
    return generator.standard_normal((n, m)) / np.sqrt(n) * factors


def pod_by_reflections(matrix: np.ndarray) -> np.ndarray:
    """Householder's QR factorisation, then the SVD of R."""
    q, r = linalg.qr(matrix, mode="economic", check_finite=False)
    return q @ linalg.svd(r, full_matrices=False, check_finite=False)[0]


def deim_loop(v: np.ndarray) -> np.ndarray:
    """The greedy loop, residual by residual."""
    n, r = v.shape
    weights, residuals = tie_weights(n), np.empty((n, r), order="F")
    entries = np.empty(r, dtype=np.int64)
    for k in range(r):
        residual = v[:, k].copy()
        for j in range(k):
            residual -= residuals[:, j] * (residual[entries[j]] / residuals[entries[j], j])
        residual[entries[:k]] = 0.0
        entries[k] = np.argmax(weights * np.abs(residual))
        residuals[:, k] = residual
    return entries


def qdeim_by_lapack(v: np.ndarray) -> np.ndarray:
    """The pivots of geqp3."""
    return linalg.qr(v.T, mode="r", pivoting=True, check_finite=False)[1][: v.shape[1]]


ALGORITHMS = {
    "pod": {"own": lambda a: pod(a)[0], "reflections": pod_by_reflections},
    "deim": {"own": deim_entries, "loop": deim_loop},
    "q-deim": {"own": lambda v: qdeim_elements(v, 1), "geqp3": qdeim_by_lapack},
    "block deim": {"own": lambda v: block_elements(v, 3)},
    "block q-deim": {"own": lambda v: qdeim_elements(v, 3)},
    "joint deim": {"own": lambda v: joint_rows(v, (True, True, True), False)},
    "s-opt": {"own": lambda v: s_opt_path(v, 1)},
}
CASES = [
    pytest.param(task, size, name, id=f"{task}-{size}-{name}")
    for task, variants in ALGORITHMS.items()
    for size in SIZES
    for name in variants
    if size != "100000x200" or task in ("pod", "deim", "q-deim")
]


@pytest.mark.parametrize(("task", "size", "name"), CASES)
def bench_offline(benchmark, task, size, name):
    """A matrix that decays to 1e-8, or its modes (as rows of memory, as bases are stored)."""
    n, columns = SIZES[size]
    matrix = decaying(np.random.default_rng(1), n, columns)
    given = np.asfortranarray(matrix) if task == "pod" else np.ascontiguousarray(pod(matrix)[0])
    benchmark.group = f"{task} {size}"
    result = benchmark.pedantic(
        ALGORITHMS[task][name], (given,), rounds=ROUNDS[size], warmup_rounds=1
    )
    assert np.isfinite(result).all()
